"""What is drawn in the scene: hand, object, forces, clearances, camera."""
