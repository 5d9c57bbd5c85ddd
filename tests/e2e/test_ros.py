"""api/examples/ros2_publisher.py over a real daemon, with modules in ROS's place whose messages take what the definitions of
sensor_msgs, geometry_msgs and std_msgs declare, and refuse every other name, type, length and range, as rclpy's own do."""
import array
import importlib.util
import os
import pathlib
import re
import sys
import types

HERE = pathlib.Path(__file__)
ROOT = pathlib.Path(os.environ["SPLATD_SOURCE_ROOT"]).resolve()
sys.path[:0] = [str(HERE.parents[1] / "http"), str(ROOT / "api" / "clients")]
import numpy as np
from harness import REAL, Daemon, run
from splatd import Splatd

# As ROS 2 has them (humble to jazzy), without comments.
DEFINITIONS = {
    "Time": "int32 sec\nuint32 nanosec",
    "Header": "Time stamp\nstring frame_id",
    "Image": "Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\nuint8[] data",
    "CompressedImage": "Header header\nstring format\nuint8[] data",
    "CameraInfo": "Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\nfloat64[9] k\nfloat64[9] r\nfloat64[12] p\n"
                  "uint32 binning_x\nuint32 binning_y\nRegionOfInterest roi",
    "RegionOfInterest": "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify",
    "PointField": "uint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\nuint8 UINT16=4\nuint8 INT32=5\nuint8 UINT32=6\nuint8 FLOAT32=7\nuint8 FLOAT64=8\n"
                  "string name\nuint32 offset\nuint8 datatype\nuint32 count",
    "PointCloud2": "Header header\nuint32 height\nuint32 width\nPointField[] fields\nbool is_bigendian\nuint32 point_step\nuint32 row_step\n"
                   "uint8[] data\nbool is_dense",
    "Point": "float64 x\nfloat64 y\nfloat64 z", "Vector3": "float64 x\nfloat64 y\nfloat64 z", "Quaternion": "float64 x\nfloat64 y\nfloat64 z\nfloat64 w",
    "Pose": "Point position\nQuaternion orientation", "PoseStamped": "Header header\nPose pose",
    "Transform": "Vector3 translation\nQuaternion rotation", "TransformStamped": "Header header\nstring child_frame_id\nTransform transform",
}
CLASSES = {}


def check(kind, value):
    """AssertionError where `value` is none of `kind`."""
    found = re.fullmatch(r"(\w+)\[(\d*)\]", kind)
    if found:
        assert not found[2] or len(value) == int(found[2]), (kind, len(value))
        if found[1] == "uint8":
            assert isinstance(value, array.array) and value.typecode == "B", (kind, type(value))  # what rclpy takes without looking at each
        else:
            for item in value:
                check(found[1], item)
        return
    if kind in DEFINITIONS:
        assert type(value) is CLASSES[kind], (kind, type(value))
    elif kind == "bool":
        assert type(value) is bool, (kind, value)
    elif kind == "string":
        assert type(value) is str, (kind, value)
    elif kind.startswith("float"):
        assert type(value) is float, (kind, value)
    else:
        bits = int(kind.lstrip("uint"))
        low, high = (0, 2**bits) if kind[0] == "u" else (-2 ** (bits - 1), 2 ** (bits - 1))
        assert type(value) is int and low <= value < high, (kind, value)


def usual(kind):
    found = re.fullmatch(r"(\w+)\[(\d*)\]", kind)
    if found:
        return b"" if found[1] == "uint8" else [0.0] * int(found[2] or 0)
    return CLASSES[kind]() if kind in DEFINITIONS else {"string": "", "bool": False}.get(kind, 0.0 if kind[0] == "f" else 0)


def make_class(name):
    lines = [line.split(maxsplit=1) for line in DEFINITIONS[name].split("\n")]
    fields = {field: kind for kind, field in lines if "=" not in field}

    class Message:
        def __init__(self, **given):
            for field, kind in fields.items():
                object.__setattr__(self, field, usual(kind))
            for field, value in given.items():
                setattr(self, field, value)

        def __setattr__(self, field, value):
            assert field in fields, f"{name} has no field '{field}'"
            check(fields[field], value)
            object.__setattr__(self, field, value)
    for kind, constant in lines:
        if "=" in constant:
            setattr(Message, constant.partition("=")[0], int(constant.partition("=")[2]))
    Message.__name__ = name
    CLASSES[name] = Message


for name in DEFINITIONS:
    make_class(name)


class Node:
    """As much of rclpy's as the example uses; what is published stands in `sent`."""
    given = {}

    def __init__(self, name):
        self.name, self.parameters, self.sent, self.said, self.timers, self.subscriptions = name, {}, {}, [], [], {}

    def declare_parameter(self, name, value):
        assert type(self.given.get(name, value)) is type(value), name
        self.parameters[name] = self.given.get(name, value)

    def get_parameter(self, name):
        return types.SimpleNamespace(value=self.parameters[name])

    def create_publisher(self, kind, topic, depth):
        assert kind in CLASSES.values() and type(depth) is int and re.fullmatch(r"[a-z_/]+", topic)

        def publish(message):
            assert type(message) is kind, (topic, type(message))
            self.sent.setdefault(topic, []).append(message)
        return types.SimpleNamespace(publish=publish)

    def create_subscription(self, kind, topic, callback, depth):
        self.subscriptions[topic] = kind, callback

    def create_timer(self, seconds, callback):
        assert seconds > 0
        self.timers.append(callback)

    def get_logger(self):
        return types.SimpleNamespace(warning=self.said.append, error=self.said.append, info=self.said.append)


class Lost(Exception):
    pass


def load(transform=None):
    """The example, with these modules in ROS's place."""
    def module(name, **members):
        sys.modules[name] = types.ModuleType(name)
        vars(sys.modules[name]).update(members)
        return sys.modules[name]
    top = module("rclpy")
    top.node, top.executors, top.time = (module("rclpy.node", Node=Node), module("rclpy.executors", ExternalShutdownException=KeyboardInterrupt),
                                         module("rclpy.time", Time=lambda: 0))
    module("sensor_msgs")
    module("sensor_msgs.msg", **{name: CLASSES[name] for name in ("CameraInfo", "CompressedImage", "Image", "PointCloud2", "PointField")})
    module("geometry_msgs")
    module("geometry_msgs.msg", PoseStamped=CLASSES["PoseStamped"])

    class Buffer:
        def lookup_transform(self, target, source, time):
            if transform is None:
                raise Lost(f"no transform from {source} to {target}")
            assert (target, source) == ("map", "camera_optical")
            return transform
    module("tf2_ros", Buffer=Buffer, TransformListener=lambda buffer, node: None, TransformException=Lost)
    spec = importlib.util.spec_from_file_location("ros2_publisher", ROOT / "api/examples/ros2_publisher.py")
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    return example


# From (3, 0, 1) along -x: the camera's z is -x, its x is +y, its y is -z.
LOOK = dict(zip("xyzw", (-0.5, -0.5, 0.5, 0.5)))


def pose(frame="map", turn=LOOK, **at):
    of = CLASSES
    return of["PoseStamped"](header=of["Header"](stamp=of["Time"](sec=7, nanosec=9), frame_id=frame), pose=of["Pose"](
        position=of["Point"](**{"x": 3.0, "y": 0.0, "z": 1.0, **at}), orientation=of["Quaternion"](**turn)))


def start(d, example, **given):
    Node.given = {"service": f"http://127.0.0.1:{d.port}", "dataset": "wall", "width": 65, "height": 49, "fov": 60.0, **given}
    return example.Publisher()


def test_the_stub_refuses_what_ros_refuses():
    for wrong in (lambda: setattr(CLASSES["Image"](), "heigth", 1), lambda: setattr(CLASSES["Image"](), "height", 1.0), lambda: setattr(CLASSES["Image"](), "height", -1),
                  lambda: setattr(CLASSES["CameraInfo"](), "k", [0.0] * 8), lambda: setattr(CLASSES["CameraInfo"](), "k", [0] * 9),
                  lambda: setattr(CLASSES["PointCloud2"](), "fields", [5]), lambda: setattr(CLASSES["Image"](), "data", "x")):
        try:
            wrong()
        except AssertionError:
            continue
        raise RuntimeError("it was taken")


def test_poses_become_images_and_points():
    example = load()
    with Daemon(REAL, datasets=[os.environ["SPLATD_WALL"]]) as d:
        wall = Splatd(f"http://127.0.0.1:{d.port}").dataset("wall")
        metres = {"m": 1, "ft": 0.3048, "us-ft": 1200 / 3937}[wall.info["unit"]]
        node = start(d, example)
        kind, take = node.subscriptions["pose"]
        assert kind is CLASSES["PoseStamped"]
        node.timers[0]()
        assert not node.sent  # no pose, no image
        take(pose(**{axis: value * metres for axis, value in zip("xyz", (3.0, 0.0, 1.0))}))
        node.timers[0]()
        node.timers[0]()  # the same pose is drawn once
        assert {topic: len(messages) for topic, messages in node.sent.items()} == {"image_raw": 1, "depth": 1, "points": 1, "camera_info": 1}, (node.sent, node.said)
        image, depth, points, info = (node.sent[topic][0] for topic in ("image_raw", "depth", "points", "camera_info"))
        for message in image, depth, points, info:
            assert (message.header.stamp.sec, message.header.stamp.nanosec, message.header.frame_id) == (7, 9, "camera_optical")
            assert (message.height, message.width) == (49, 65)
        look = dict(eye=[3, 0, 1], target=[0, 0, 1], up=[0, 0, 1], fov=60, width=65, height=49)
        seen = wall.array("color", **look)[..., :3]
        assert image.encoding == "rgb8" and image.step == 195 and len(image.data) == 49 * image.step
        assert (np.abs(np.frombuffer(image.data, np.uint8).reshape(seen.shape).astype(int) - seen) > 1).mean() < 0.01
        metric = np.frombuffer(depth.data, "<f4").reshape(49, 65)
        assert depth.encoding == "32FC1" and depth.step == 260 and abs(metric[24, 32] - 3 * metres) < 0.01 and np.isnan(metric[0, 0])
        # CameraInfo, given back as ROS gives it, is the same view
        ros = {"k": info.k, "width": info.width, "height": info.height, "d": info.d, "distortion_model": info.distortion_model}
        again = wall.view(camera={"ros": ros, "matrix": [[0, 0, -1, 3], [1, 0, 0, 0], [0, -1, 0, 1], [0, 0, 0, 1]], "convention": "opencv"})
        assert abs(again.camera["cx"] - 32.5) < 1e-9 and abs(again.camera["fx"] - info.p[0]) < 1e-9 and info.p[2] == info.k[2] and info.r[0] == info.r[4] == info.r[8] == 1
        # points, in the optical frame: on the wall
        assert [(f.name, f.offset, f.datatype, f.count) for f in points.fields] == [(n, 4 * i, 7, 1) for i, n in enumerate(("x", "y", "z", "rgb"))]
        assert points.point_step == 16 and points.row_step == 16 * 65 and len(points.data) == 49 * points.row_step and not points.is_dense
        rows = np.frombuffer(points.data, "<f4,<f4,<f4,u1,u1,u1,u1").reshape(49, 65)
        at = rows[24, 40]
        world = 3 - at[2] / metres, at[0] / metres, 1 - at[1] / metres
        picked = wall.pick(40.5, 24.5, **look)["position"]
        assert np.allclose(world, picked, atol=1e-4), (world, picked)
        assert [at[5], at[4], at[3]] == [*np.frombuffer(image.data, np.uint8).reshape(49, 65, 3)[24, 40]]  # bgr0 in memory


def test_where_the_map_lies_and_what_is_compressed():
    with Daemon(REAL) as d:
        wall = Splatd(f"http://127.0.0.1:{d.port}").dataset("wall")
        metres = {"m": 1, "ft": 0.3048, "us-ft": 1200 / 3937}[wall.info["unit"]]
        found = CLASSES["TransformStamped"](header=pose().header, transform=CLASSES["Transform"](
            translation=CLASSES["Vector3"](x=0.0, y=0.0, z=1.0 * metres), rotation=CLASSES["Quaternion"](**LOOK)))
        node = start(d, load(found), tf=True, origin=[3.0, 0.0, 0.0], compressed=True, points=False, depth=False)
        node.timers[0]()
        assert set(node.sent) == {"image_raw/compressed", "camera_info"} and not node.subscriptions, (node.sent, node.said)
        message = node.sent["image_raw/compressed"][0]
        assert message.format == "jpeg" and message.data.tobytes() == wall.view(camera={
            "matrix": [[0, 0, -1, 3], [1, 0, 0, 0], [0, -1, 0, 1], [0, 0, 0, 1]], "convention": "opencv", "fx": node.focal, "fy": node.focal, "cx": 32.5, "cy": 24.5},
            width=65, height=49).bytes
        lost = start(d, load(), tf=True)
        lost.timers[0]()
        assert not lost.sent and "no transform" in lost.said[0]


def test_what_goes_wrong_is_logged_and_it_goes_on():
    with Daemon(REAL) as d:
        node = start(d, load())
        take = node.subscriptions["pose"][1]
        take(pose("odom"))
        assert "'odom'" in node.said[0]
        for wrong, said in ((pose(turn=dict.fromkeys("xyzw", 0.0)), "zero"), (pose(x=1e30), "400: ")):
            take(wrong)
            node.timers[0]()
            assert said in node.said[-1] and not node.sent, node.said
        take(pose())
        node.timers[0]()
        assert len(node.sent["image_raw"]) == 1


run(globals())
