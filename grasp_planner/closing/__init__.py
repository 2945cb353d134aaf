"""How a planned grasp closes: the path from an open hand, touches and slip one after the other, what then holds."""
