"""What runs inside a service under attack; Python loads it by itself from a folder of its search path."""
