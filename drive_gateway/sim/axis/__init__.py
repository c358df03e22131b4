"""The full level of a simulated axis: motor, load, encoder, servo loop, power and what protects them."""
