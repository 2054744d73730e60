"""Drives as ROS records them, written with rosbags itself: each topic at its own rate, one long recording."""

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from tests.diagnose.logs import EPOCH_NS
from tests.diagnose.worlds import BASE_M

KINDS = ("bag", "mcap", "db3", "folder")


def write_bag(path, table, topics, kind="folder"):
    """``table``: one long log (`logs.continuous`). ``topics``: name -> function of a writer of messages; the path of the bag."""
    store = get_typestore(Stores.ROS1_NOETIC if kind == "bag" else Stores.ROS2_HUMBLE)
    make = Messages(store, kind == "bag")
    if kind == "bag":
        file = path / "drive.bag"
        with Writer1(file) as writer:
            _write(writer, store.serialize_ros1, store, make, table, topics)
        return file
    folder = path / f"drive_{kind}"
    plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
    with Writer(folder, version=9, storage_plugin=plugin) as writer:
        _write(writer, store.serialize_cdr, store, make, table, topics)
    return folder if kind == "folder" else next(folder.glob(f"*.{kind}"))


def _write(writer, serialize, store, make, table, topics):
    rows = []
    for name, messages in topics.items():
        for at_s, message in messages(make, table):
            rows.append((EPOCH_NS + round(at_s * 1e9), name, message))
    connections = {}
    for stamp, name, message in sorted(rows, key=lambda row: row[0]):
        kind = message.__msgtype__
        if name not in connections:
            connections[name] = writer.add_connection(name, kind, typestore=store)
        writer.write(connections[name], stamp, serialize(message, kind))


class Messages:
    """Messages of a type store."""

    def __init__(self, store, old):
        self.types, self._old = store.types, old

    def __call__(self, kind, **fields):
        return self.types[kind](**fields)

    def header(self, at_s, frame="world"):
        """Stamped by the recorder's clock."""
        whole = EPOCH_NS + round(at_s * 1e9)
        stamp = self("builtin_interfaces/msg/Time", sec=whole // 10**9, nanosec=whole % 10**9)
        more = {"seq": 0} if self._old else {}
        return self("std_msgs/msg/Header", stamp=stamp, frame_id=frame, **more)

    def vector(self, x=0.0, y=0.0, z=0.0):
        return self("geometry_msgs/msg/Vector3", x=float(x), y=float(y), z=float(z))

    def pose(self, x, y, heading):
        point = self("geometry_msgs/msg/Point", x=float(x), y=float(y), z=0.0)
        return self("geometry_msgs/msg/Pose", position=point, orientation=self.turned(heading))

    def turned(self, heading):
        half = float(heading) / 2
        return self("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=float(np.sin(half)), w=float(np.cos(half)))

    def twist(self, forward, turn):
        return self("geometry_msgs/msg/Twist", linear=self.vector(x=forward), angular=self.vector(z=turn))


def _changes(table):
    """Times (a millisecond before the frame) and speeds of the body wherever a command changes."""
    left, right = table["left_m_s"].fillna(0.0).to_numpy(), table["right_m_s"].fillna(0.0).to_numpy()
    new = np.append(True, (np.diff(left) != 0) | (np.diff(right) != 0))
    for at in np.flatnonzero(new):
        yield float(table["t_s"].iloc[at]) + 0.1, (left[at] + right[at]) / 2, (right[at] - left[at]) / BASE_M


def _frames(table):
    for row in table.itertuples():
        yield row.t_s + 0.101, row.x_m, row.y_m, row.heading_rad


def twist(make, table):
    for at, forward, turn in _changes(table):
        yield at, make.twist(forward, turn)


def twist_stamped(make, table):
    for at, forward, turn in _changes(table):
        yield at, make("geometry_msgs/msg/TwistStamped", header=make.header(at, "base"), twist=make.twist(forward, turn))


def pose_stamped(make, table):
    for at, *pose in _frames(table):
        yield at, make("geometry_msgs/msg/PoseStamped", header=make.header(at), pose=make.pose(*pose))


def odometry(make, table):
    for at, *pose in _frames(table):
        still = np.zeros(36)
        yield at, make(
            "nav_msgs/msg/Odometry",
            header=make.header(at, "odom"),
            child_frame_id="base_link",
            pose=make("geometry_msgs/msg/PoseWithCovariance", pose=make.pose(*pose), covariance=still),
            twist=make("geometry_msgs/msg/TwistWithCovariance", twist=make.twist(0.01, 0.0), covariance=still),
        )


def transforms(make, table):
    for at, x, y, heading in _frames(table):
        moved = make("geometry_msgs/msg/Transform", translation=make.vector(x, y), rotation=make.turned(heading))
        one = make(
            "geometry_msgs/msg/TransformStamped", header=make.header(at, "map"), child_frame_id="base_link", transform=moved
        )
        yield at, make("tf2_msgs/msg/TFMessage", transforms=[one])


def joints(radius_m):
    """Speeds of both wheels, rad/s, whenever they change and at every tenth frame."""

    def messages(make, table):
        for at, forward, turn in _changes(table):
            left, right = forward - turn * BASE_M / 2, forward + turn * BASE_M / 2
            yield at, make(
                "sensor_msgs/msg/JointState",
                header=make.header(at, ""),
                name=["wheel_right_joint", "wheel_left_joint"],
                position=np.zeros(2),
                velocity=np.array([right, left]) / radius_m,
                effort=np.zeros(0),
            )

    return messages
