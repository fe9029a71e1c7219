"""Runs of a server for other programs: `palmares foxglove` and `palmares ros2`."""
