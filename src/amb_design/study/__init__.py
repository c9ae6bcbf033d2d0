"""The model in other people's studies: CasADi Functions of a machine's numbers, with documented ports."""
