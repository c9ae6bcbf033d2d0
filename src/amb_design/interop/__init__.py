"""Bridges to other packages, one file each; a package loads when its bridge is first used."""
