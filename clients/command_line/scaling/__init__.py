"""How far frames scale over the nodes of a cluster: simulated, from rates that were measured."""
