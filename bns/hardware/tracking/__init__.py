"""Trackers: from camera frames or infra-red blobs to poses, or to an explicit `None` when the robot is not seen."""
