"""What is to be planned: hand + object + task + parameters, what keeps clear, what is withstood."""
