"""The contract every store keeps, run over each of them."""
