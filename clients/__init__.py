"""What talks to the service, and the command line."""
