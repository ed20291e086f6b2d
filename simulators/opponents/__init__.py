"""What elm is compared with, each run by an interpreter of its own: nothing of elm imports it, nor it elm."""
