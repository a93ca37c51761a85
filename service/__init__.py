"""The network service: HTTP in front of the renderer."""
