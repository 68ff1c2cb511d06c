"""What the test of a real server is made of; nothing of it belongs to a client."""
