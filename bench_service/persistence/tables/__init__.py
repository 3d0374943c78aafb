"""SQL tables, divided like the ports of the stores; `every` imports all of them, for migrations."""
