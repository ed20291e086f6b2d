"""The tests of elm: each room by itself, every store by one contract, and the documents by their examples."""
