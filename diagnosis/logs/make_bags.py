"""Bags of ROS 2 that other programs' writers made, which the tests of the reader read.

    pip install mcap==1.6.0 mcap-ros2-support==0.6.0 rosbags==0.11.9
    python make_bags.py

Made up: two Crazyflies for two seconds, cf1 on a circle of 0.5 m radius at 1 rad/s, 1 m up, its nose
along its way; cf2 hovers at (0, 0, 2). `foxglove.mcap` is written by the `mcap` package with chunks
packed by zstd, `lz4.mcap` by the same with lz4, `rosbags.mcap` by the `rosbags` package without; `plain.mcap`
writes each message by itself.
"""

import math
import shutil
from pathlib import Path

import numpy as np
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from mcap_ros2.writer import Writer as Ros2Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as BagWriter
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

START_NS = 1_700_000_000_000_000_000
RULE = "=" * 80
HEADER = "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id"
TIME = "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec"
POSE = "MSG: geometry_msgs/Pose\nPoint position\nQuaternion orientation"
POINT = "MSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z"
QUATERNION = "MSG: geometry_msgs/Quaternion\nfloat64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1"
VECTOR = "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z"
TWIST = "MSG: geometry_msgs/Twist\nVector3  linear\nVector3  angular"


def joined(*parts):
    return f"\n{RULE}\n".join(parts)


ODOMETRY = joined(
    "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\ngeometry_msgs/TwistWithCovariance twist",
    HEADER, TIME,
    "MSG: geometry_msgs/PoseWithCovariance\nPose pose\n# row-major\nfloat64[36] covariance",
    "MSG: geometry_msgs/TwistWithCovariance\nTwist twist\nfloat64[36] covariance",
    POSE, POINT, QUATERNION, TWIST, VECTOR,
)
IMU = joined(
    "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n"
    "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
    "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance",
    HEADER, TIME, QUATERNION, VECTOR,
)
BATTERY = joined(
    "uint8 POWER_SUPPLY_STATUS_UNKNOWN = 0\nstd_msgs/Header header\nfloat32 voltage\nfloat32 temperature\nfloat32 current\n"
    "float32 charge\nfloat32 capacity\nfloat32 design_capacity\nfloat32 percentage\nuint8 power_supply_status\n"
    "uint8 power_supply_health\nuint8 power_supply_technology\nbool present\nfloat32[] cell_voltage\n"
    "float32[] cell_temperature\nstring location\nstring serial_number",
    HEADER, TIME,
)
GENERIC = joined("std_msgs/Header header\nuint32 timestamp\nfloat32[] values", HEADER, TIME)
POSE_STAMPED = joined("std_msgs/Header header\nPose pose", HEADER, TIME, POSE, POINT, QUATERNION)


def header(t_s, frame):
    ns = START_NS + round(t_s * 1e9)
    return {"stamp": {"sec": ns // 10**9, "nanosec": ns % 10**9}, "frame_id": frame}


def cf1(t_s):
    yaw = t_s + math.pi / 2
    position = {"x": 0.5 * math.cos(t_s), "y": 0.5 * math.sin(t_s), "z": 1.0}
    turn = {"x": 0.0, "y": 0.0, "z": math.sin(yaw / 2), "w": math.cos(yaw / 2)}
    return {"position": position, "orientation": turn}


def foxglove(path, compression):
    with open(path, "wb") as file:
        writer = Ros2Writer(file, compression=compression, chunk_size=16_384)
        kinds = {
            "odometry": ("nav_msgs/msg/Odometry", ODOMETRY),
            "imu": ("sensor_msgs/msg/Imu", IMU),
            "battery": ("sensor_msgs/msg/BatteryState", BATTERY),
            "generic": ("crazyflie_interfaces/msg/LogDataGeneric", GENERIC),
            "pose": ("geometry_msgs/msg/PoseStamped", POSE_STAMPED),
        }
        schemas = {key: writer.register_msgdef(*of) for key, of in kinds.items()}

        def put(topic, kind, message, t_s, late_s=0.004):
            # The recorder gets each a little later than it says it was so.
            log_time = START_NS + round((t_s + late_s) * 1e9)
            writer.write_message(topic, schemas[kind], message, log_time=log_time, publish_time=log_time)

        zero = {"x": 0.0, "y": 0.0, "z": 0.0}
        for tick in range(200):
            t_s = 0.01 * tick
            put("/cf1/imu", "imu", {
                "header": header(t_s, "cf1"),
                "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
                "orientation_covariance": [-1.0] + [0.0] * 8,
                "angular_velocity": {"x": 0.0, "y": 0.0, "z": 1.0},
                "angular_velocity_covariance": [0.0] * 9,
                "linear_acceleration": {"x": 0.0, "y": 0.5, "z": 9.81},
                "linear_acceleration_covariance": [0.0] * 9,
            }, t_s)
            if tick % 2 == 0:
                put("/cf1/odom", "odometry", {
                    "header": header(t_s, "world"),
                    "child_frame_id": "cf1",
                    "pose": {"pose": cf1(t_s), "covariance": [0.0] * 36},
                    "twist": {"twist": {"linear": {"x": 0.5, "y": 0.0, "z": 0.0}, "angular": zero}, "covariance": [0.0] * 36},
                }, t_s)
                put("/cf2/pose", "pose", {
                    "header": header(t_s, "world"),
                    "pose": {"position": {"x": 0.0, "y": 0.0, "z": 2.0}, "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}},
                }, t_s)
                for drone in ["cf1", "cf2"]:
                    values = [0.5, 0.51, 0.52, 0.53 + 0.01 * (drone == "cf2")]
                    values = [65_535.0 * value for value in values]
                    put(f"/{drone}/motors", "generic", {"header": header(t_s, "world"), "timestamp": 10 * tick, "values": values}, t_s)
            if tick % 50 == 0:
                put("/cf1/battery", "battery", {
                    "header": header(t_s, ""), "voltage": 3.9, "temperature": 0.0, "current": 0.0, "charge": 0.0,
                    "capacity": 0.0, "design_capacity": 0.0, "percentage": 0.5, "power_supply_status": 0,
                    "power_supply_health": 0, "power_supply_technology": 0, "present": True, "cell_voltage": [3.9],
                    "cell_temperature": [], "location": "", "serial_number": "a",
                }, t_s)
        writer.finish()


def rosbags(path):
    store = get_typestore(Stores.ROS2_HUMBLE)
    named = "motion_capture_tracking_interfaces/msg/NamedPose"
    array = "motion_capture_tracking_interfaces/msg/NamedPoseArray"
    store.register(get_types_from_msg("string name\ngeometry_msgs/Pose pose", named))
    store.register(get_types_from_msg("std_msgs/Header header\nNamedPose[] poses", array))
    types = store.types
    folder = Path("rosbags_made")
    shutil.rmtree(folder, ignore_errors=True)
    stamp = lambda t_s: (START_NS + round(t_s * 1e9))
    time = lambda ns: types["builtin_interfaces/msg/Time"](sec=ns // 10**9, nanosec=ns % 10**9)
    head = lambda t_s, frame: types["std_msgs/msg/Header"](stamp=time(stamp(t_s)), frame_id=frame)
    vector = types["geometry_msgs/msg/Vector3"]
    point = types["geometry_msgs/msg/Point"]
    quaternion = types["geometry_msgs/msg/Quaternion"]
    with BagWriter(folder, version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        poses = bag.add_connection("/poses", array, typestore=store)
        imu = bag.add_connection("/cf2/imu", "sensor_msgs/msg/Imu", typestore=store)
        for tick in range(100):
            t_s = 0.02 * tick
            of = cf1(t_s)
            one = types["geometry_msgs/msg/Pose"](position=point(**of["position"]), orientation=quaternion(**of["orientation"]))
            other = types["geometry_msgs/msg/Pose"](position=point(x=0.0, y=0.0, z=2.0), orientation=quaternion(x=0.0, y=0.0, z=0.0, w=1.0))
            message = types[array](header=head(t_s, "world"), poses=[
                types[named](name="cf1", pose=one), types[named](name="cf2", pose=other), types[named](name="wand", pose=other),
            ])
            bag.write(poses, stamp(t_s), store.serialize_cdr(message, array))
            message = types["sensor_msgs/msg/Imu"](
                header=head(t_s, "cf2"), orientation=quaternion(x=0.0, y=0.0, z=0.0, w=1.0), orientation_covariance=np.zeros(9),
                angular_velocity=vector(x=0.0, y=0.0, z=0.0), angular_velocity_covariance=np.zeros(9),
                linear_acceleration=vector(x=0.0, y=0.0, z=9.81), linear_acceleration_covariance=np.zeros(9),
            )
            bag.write(imu, stamp(t_s), store.serialize_cdr(message, "sensor_msgs/msg/Imu"))
    shutil.move(next(folder.glob("*.mcap")), path)
    shutil.rmtree(folder)


def plain(path):
    """A tenth of a second of odometry and motors in records of their own, without chunks: what changes at random reach."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    types = store.types
    actuators = "actuator_msgs/msg/Actuators"
    store.register(get_types_from_msg("std_msgs/Header header\nfloat64[] position\nfloat64[] velocity\nfloat64[] normalized", actuators))
    definitions = {
        "nav_msgs/msg/Odometry": ODOMETRY,
        actuators: joined("std_msgs/Header header\nfloat64[] position\nfloat64[] velocity\nfloat64[] normalized", HEADER, TIME),
    }
    with open(path, "wb") as file:
        writer = McapWriter(file, use_chunking=False)
        writer.start(profile="ros2", library="made up")
        channels = {}
        for topic, name in [("/cf1/odom", "nav_msgs/msg/Odometry"), ("/cf1/actuators", actuators)]:
            schema = writer.register_schema(name=name, encoding="ros2msg", data=definitions[name].encode())
            channels[name] = writer.register_channel(topic=topic, message_encoding="cdr", schema_id=schema)
        vector = types["geometry_msgs/msg/Vector3"]
        for tick in range(10):
            ns = START_NS + 20_000_000 * tick
            stamp = types["builtin_interfaces/msg/Time"](sec=ns // 10**9, nanosec=ns % 10**9)
            head = types["std_msgs/msg/Header"](stamp=stamp, frame_id="world")
            of = cf1(0.02 * tick)
            pose = types["geometry_msgs/msg/Pose"](
                position=types["geometry_msgs/msg/Point"](**of["position"]),
                orientation=types["geometry_msgs/msg/Quaternion"](**of["orientation"]),
            )
            twist = types["geometry_msgs/msg/Twist"](linear=vector(x=0.5, y=0.0, z=0.0), angular=vector(x=0.0, y=0.0, z=1.0))
            odometry = types["nav_msgs/msg/Odometry"](
                header=head, child_frame_id="cf1",
                pose=types["geometry_msgs/msg/PoseWithCovariance"](pose=pose, covariance=np.zeros(36)),
                twist=types["geometry_msgs/msg/TwistWithCovariance"](twist=twist, covariance=np.zeros(36)),
            )
            motors = types[actuators](header=head, position=np.zeros(0), velocity=np.array([2000.0, 2100.0, -2000.0, -2100.0]), normalized=np.zeros(0))
            for name, message in [("nav_msgs/msg/Odometry", odometry), (actuators, motors)]:
                writer.add_message(channels[name], log_time=ns, publish_time=ns, data=bytes(store.serialize_cdr(message, name)))
        writer.finish()


foxglove("foxglove.mcap", CompressionType.ZSTD)
foxglove("lz4.mcap", CompressionType.LZ4)
rosbags("rosbags.mcap")
plain("plain.mcap")
