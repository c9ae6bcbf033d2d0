"""What the machine is: frozen objects, and the TOML files that hold them."""
