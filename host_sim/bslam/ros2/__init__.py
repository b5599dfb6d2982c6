"""Logs of ROS 2: bags as log folders, and the handling of messages that a node shares.

`messages` and `geometry` import nothing of ROS: they work on any object that has a message's fields, of rclpy
or of rosbags alike. `bag` reads rosbag2 files through the package rosbags, `importer` makes a log of one.
"""
