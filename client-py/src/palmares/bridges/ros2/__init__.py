"""A run as a node of ROS 2, without ROS: the standard messages over DDS."""
