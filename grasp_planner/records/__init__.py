"""The JSON contract: grasps and analyses written and read."""
