"""ArmarX-style robot memory on top of elm: not there yet, the package only holds its place in the wheel."""
