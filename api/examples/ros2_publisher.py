#!/usr/bin/env python3
"""What a camera would see in a scan, as ROS 2 topics: images, depth, CameraInfo and points, for poses that arrive.

    python3 ros2_publisher.py --ros-args -p service:=http://127.0.0.1:8080 -p dataset:=hall -p fov:=60.0
    # looks along the map's x
    ros2 topic pub -1 /pose geometry_msgs/msg/PoseStamped "{header: {frame_id: map}, pose: {position: {x: 4.0, z: 1.7},
      orientation: {x: -0.5, y: 0.5, z: -0.5, w: 0.5}}}"

A pose is that of the camera's optical frame (REP 103: x right, y down, z forward) in the frame `map`, in metres; `origin` says
where the map's origin lies in the dataset's coordinates, so that UTM stays out of ROS (-p origin:="[636000.0, 851000.0, 0.0]": ROS's parameters
have types, decimals are needed). RViz needs a transform from `map_frame` to `camera_frame`, which this does not publish. With -p tf:=true poses are not taken from
the topic `pose`: the transform from `map_frame` to `camera_frame` is looked up at `rate` a second.

Published, all with the pose's stamp: image_raw (rgb8), or with -p compressed:=true image_raw/compressed (jpeg); depth (32FC1, metres,
NaN where nothing is); camera_info; points (organised PointCloud2 of x, y, z, rgb, in the optical frame), each where its switch
(image, depth, points) is on. Needs rclpy and its messages, which bring numpy, and tf2_ros with tf:=true; nothing else."""
import array
import io
import json
import sys
import urllib.error
import urllib.parse
import urllib.request
import zipfile

import numpy as np
import rclpy
import rclpy.executors
import rclpy.time
from geometry_msgs.msg import PoseStamped
from rclpy.node import Node
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2, PointField

METRES = {"m": 1, "ft": 0.3048, "us-ft": 1200 / 3937, "km": 1000, "cm": 0.01, "mm": 0.001, "yd": 0.9144, "in": 0.0254, "unit": 1}


def matrix_of(position, orientation, origin, metres):
    """Camera to world, rows, of a pose in metres: in the dataset's unit."""
    x, y, z, w = (getattr(orientation, name) for name in "xyzw")
    length = (x * x + y * y + z * z + w * w) ** 0.5
    if length < 1e-9:
        raise ValueError("the pose's orientation is zero; a pose without a turn has w = 1")
    x, y, z, w = x / length, y / length, z / length, w / length
    at = [origin[i] + getattr(position, name) / metres for i, name in enumerate("xyz")]
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), at[0]],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), at[1]],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), at[2]], [0, 0, 0, 1]]


class Publisher(Node):
    def __init__(self):
        super().__init__("splatd_publisher")
        usual = {"service": "http://127.0.0.1:8080", "dataset": "hall", "token": "", "width": 640, "height": 480, "fov": 60.0, "origin": [0.0, 0.0, 0.0],
                 "map_frame": "map", "camera_frame": "camera_optical", "tf": False, "rate": 5.0, "image": True, "depth": True, "points": True,
                 "compressed": False}
        for name, value in usual.items():
            self.declare_parameter(name, value)
        self.setting = {name: self.get_parameter(name).value for name in usual}
        self.url = f"{self.setting['service'].rstrip('/')}/v1/datasets/{urllib.parse.quote(self.setting['dataset'], safe='')}"
        unit = json.loads(self.ask(self.url))["unit"]
        self.metres = METRES[unit] if unit in METRES else float(unit.split()[0])  # "0.2 m"
        self.width, self.height = self.setting["width"], self.setting["height"]
        self.focal = self.height / 2 / np.tan(np.radians(self.setting["fov"]) / 2)
        self.image = self.create_publisher(Image, "image_raw", 1) if self.setting["image"] and not self.setting["compressed"] else None
        self.compressed = self.create_publisher(CompressedImage, "image_raw/compressed", 1) if self.setting["image"] and self.setting["compressed"] else None
        self.depth = self.create_publisher(Image, "depth", 1) if self.setting["depth"] else None
        self.points = self.create_publisher(PointCloud2, "points", 1) if self.setting["points"] else None
        self.info = self.create_publisher(CameraInfo, "camera_info", 1)
        self.wanted = None  # the newest pose that is not drawn yet: (stamp, position, orientation)
        if self.setting["tf"]:
            from tf2_ros import Buffer, TransformListener
            self.buffer = Buffer()
            self.listener = TransformListener(self.buffer, self)
        else:
            self.create_subscription(PoseStamped, "pose", self.take, 1)
        self.create_timer(1 / self.setting["rate"], self.draw)

    def take(self, message):
        if message.header.frame_id not in ("", self.setting["map_frame"]):
            self.get_logger().warning(f"a pose in frame '{message.header.frame_id}' is left out; poses are in '{self.setting['map_frame']}'")
            return
        self.wanted = message.header.stamp, message.pose.position, message.pose.orientation

    def look_up(self):
        from tf2_ros import TransformException
        try:
            found = self.buffer.lookup_transform(self.setting["map_frame"], self.setting["camera_frame"], rclpy.time.Time())
        except TransformException as error:
            self.get_logger().warning(str(error))
            return
        self.wanted = found.header.stamp, found.transform.translation, found.transform.rotation

    def ask(self, url, document=None):
        headers = {"Content-Type": "application/json", **({"Authorization": f"Bearer {self.setting['token']}"} if self.setting["token"] else {})}
        body = None if document is None else json.dumps(document).encode()
        with urllib.request.urlopen(urllib.request.Request(url, body, headers), timeout=30) as reply:
            return reply.read()

    def draw(self):
        if self.setting["tf"]:
            self.look_up()
        if not self.wanted:
            return
        (stamp, position, orientation), self.wanted = self.wanted, None
        try:
            camera = {"matrix": matrix_of(position, orientation, self.setting["origin"], self.metres), "convention": "opencv", "fx": self.focal,
                      "fy": self.focal, "cx": self.width / 2, "cy": self.height / 2}
            self.publish(stamp, camera)
        except urllib.error.HTTPError as error:
            self.get_logger().error(f"{error.code}: {json.loads(error.read() or b'{}').get('detail', error.reason)}")
        except (OSError, ValueError) as error:
            self.get_logger().error(str(error))

    def publish(self, stamp, camera):
        view = {"camera": camera, "width": self.width, "height": self.height}
        if self.compressed:
            message = self.stamped(CompressedImage(), stamp)
            message.format = "jpeg"
            message.data = array.array("B", self.ask(f"{self.url}/view", {**view, "format": "jpeg"}))
            self.compressed.publish(message)
        layers = zipfile.ZipFile(io.BytesIO(self.ask(f"{self.url}/view", {**view, "layers": ["color", "depth"], "format": "raw", "container": "zip"})))
        color = np.frombuffer(layers.read("color.raw"), np.uint8).reshape(self.height, self.width, 4)[..., :3]
        depth = np.frombuffer(layers.read("depth.raw"), "<f4").reshape(self.height, self.width) * np.float32(self.metres)
        if self.image:
            self.image.publish(self.picture(stamp, "rgb8", color))
        if self.depth:
            self.depth.publish(self.picture(stamp, "32FC1", depth.astype("<f4")))
        if self.points:
            self.points.publish(self.cloud(stamp, color, depth))
        self.info.publish(self.describe(stamp))

    def stamped(self, message, stamp):
        message.header.stamp = stamp
        message.header.frame_id = self.setting["camera_frame"]
        return message

    def picture(self, stamp, encoding, pixels):
        message = self.stamped(Image(), stamp)
        message.height, message.width = self.height, self.width
        message.encoding, message.is_bigendian = encoding, 0
        message.step = pixels.nbytes // self.height
        message.data = array.array("B", pixels.tobytes())  # of bytes rclpy looks at each
        return message

    def describe(self, stamp):
        """ROS counts from the first pixel's centre, splatd from its corner: half a pixel less."""
        message = self.stamped(CameraInfo(), stamp)
        message.height, message.width = self.height, self.width
        message.distortion_model, message.d = "plumb_bob", [0.0] * 5
        cx, cy, f = self.width / 2 - 0.5, self.height / 2 - 0.5, float(self.focal)
        message.k = [f, 0.0, cx, 0.0, f, cy, 0.0, 0.0, 1.0]
        message.r = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
        message.p = [f, 0.0, cx, 0.0, 0.0, f, cy, 0.0, 0.0, 0.0, 1.0, 0.0]
        return message

    def cloud(self, stamp, color, depth):
        u, v = np.meshgrid(np.arange(self.width) + 0.5, np.arange(self.height) + 0.5)
        rows = np.zeros(depth.shape, [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgb", "<u4")])
        rows["x"], rows["y"], rows["z"] = (u - self.width / 2) / self.focal * depth, (v - self.height / 2) / self.focal * depth, depth
        red, green, blue = (color[..., i].astype(np.uint32) for i in range(3))
        rows["rgb"] = red << 16 | green << 8 | blue
        message = self.stamped(PointCloud2(), stamp)
        message.height, message.width = self.height, self.width
        message.fields = [PointField(name=name, offset=4 * i, datatype=PointField.FLOAT32, count=1) for i, name in enumerate(("x", "y", "z", "rgb"))]
        message.is_bigendian, message.is_dense = False, False
        message.point_step, message.row_step = rows.itemsize, rows.itemsize * self.width
        message.data = array.array("B", rows.tobytes())
        return message


def main(arguments=None):
    rclpy.init(args=arguments)
    try:
        rclpy.spin(Publisher())
    except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


if __name__ == "__main__":
    main(sys.argv)
