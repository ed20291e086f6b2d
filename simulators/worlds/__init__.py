"""What is simulated: robots that live in made-up worlds, and the questions that are asked about them."""
