"""What the program promises in time, measured; `make bench` prints it."""
