"""The parts of the test of a real server; a client does not need them."""
