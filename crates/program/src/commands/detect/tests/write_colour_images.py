"""Writes colour_images.mcap with the packages mcap-ros2-support and Pillow: python3 write_colour_images.py colour_images.mcap

Three depth images, at 10, 10.1 and 10.2 s, of a ball of 36 mm before a wall, the second one with another ball beside; three colour images, at
10.004, 10.09 and 10.3 s, in which balls are red. They are there raw, packed without loss, and packed with loss, in chunks of lz4.
"""

import io
import struct
import sys

import numpy as np
from mcap_ros2.writer import CompressionType, Writer
from PIL import Image

WIDTH, HEIGHT, FOCAL = 160, 120, 150.0
WALL = 1.2
BALLS = [(0.0, 0.0, 0.6), (-0.12, 0.05, 0.7)]
RADIUS = 0.036
# Inverse depth of image_transport: value = a / depth + b.
QUANTISED = (3000.0, 100.0)
HEADER = "std_msgs/Header header\n"
PARTS = """
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
IMAGE = HEADER + "uint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\nuint8[] data" + PARTS
PACKED = HEADER + "string format\nuint8[] data" + PARTS
INFO = (
    HEADER
    + "uint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\nfloat64[9] k\nfloat64[9] r\nfloat64[12] p\n"
    + "uint32 binning_x\nuint32 binning_y\nsensor_msgs/RegionOfInterest roi"
    + PARTS
    + "=" * 80
    + "\nMSG: sensor_msgs/RegionOfInterest\nuint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n"
)


def scene(balls):
    """Depth [m] and colour."""
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    ray = np.stack([(u - (WIDTH - 1) / 2) / FOCAL, (v - (HEIGHT - 1) / 2) / FOCAL, np.ones_like(u)], axis=-1)
    square = (ray**2).sum(-1)
    depth = np.full((HEIGHT, WIDTH), WALL)
    colour = np.empty((HEIGHT, WIDTH, 3), np.uint8)
    colour[:] = (30, 90, 40)
    for c in map(np.array, balls):
        along = ray @ c
        root = along**2 - square * (c @ c - RADIUS**2)
        on = root >= 0
        depth[on] = (along[on] - np.sqrt(root[on])) / square[on]
        colour[on] = (255, 0, 0)
    return depth, colour


def packed(image, kind):
    stream = io.BytesIO()
    image.save(stream, kind, **({"quality": 95} if kind == "JPEG" else {}))
    return stream.getvalue()


def main(path):
    with open(path, "wb") as stream:
        writer = Writer(stream, compression=CompressionType.LZ4)
        image = writer.register_msgdef("sensor_msgs/msg/Image", IMAGE)
        packed_image = writer.register_msgdef("sensor_msgs/msg/CompressedImage", PACKED)
        info = writer.register_msgdef("sensor_msgs/msg/CameraInfo", INFO)

        def write(topic, schema, time, **fields):
            stamp = {"sec": time // 1000, "nanosec": time % 1000 * 1_000_000}
            header = {"stamp": stamp, "frame_id": "camera_color_optical_frame"}
            nanoseconds = time * 1_000_000 + 2_000_000
            writer.write_message(topic, schema, {"header": header, **fields}, nanoseconds, nanoseconds)

        def raw(pixels, encoding):
            step = pixels.strides[0]
            size = {"height": HEIGHT, "width": WIDTH, "step": step}
            return {**size, "encoding": encoding, "is_bigendian": 0, "data": pixels.tobytes()}

        k = [FOCAL, 0.0, (WIDTH - 1) / 2, 0.0, FOCAL, (HEIGHT - 1) / 2, 0.0, 0.0, 1.0]
        camera = {"height": HEIGHT, "width": WIDTH, "distortion_model": "plumb_bob", "d": [0.0] * 5, "k": k}
        camera |= {"r": [0.0] * 9, "p": [0.0] * 12, "binning_x": 0, "binning_y": 0}
        camera |= {"roi": {"x_offset": 0, "y_offset": 0, "height": 0, "width": 0, "do_rectify": False}}
        write("/camera/depth/camera_info", info, 9_900, **camera)
        for number, (at, colour_at) in enumerate([(10_000, 10_004), (10_100, 10_090), (10_200, 10_300)]):
            depth, colour = scene(BALLS if number == 1 else BALLS[:1])
            whole = np.round(depth * 1000).astype("<u2")
            a, b = QUANTISED
            inverse = np.round(a / depth + b).astype("<u2")
            parts = struct.pack("<iff", 0, 0.0, 0.0), struct.pack("<iff", 1, a, b)
            names = "16UC1; compressedDepth png", "32FC1; compressedDepth png"
            topic = "/camera/depth/image"
            write(topic, image, at, **raw(whole, "16UC1"))
            for name, header, values, below in zip(names, parts, [whole, inverse], ["", "_inverse"]):
                data = header + packed(Image.fromarray(values), "PNG")
                write(f"{topic}{below}/compressedDepth", packed_image, at, format=name, data=data)
            topic = "/camera/color/image"
            write(topic, image, colour_at, **raw(np.ascontiguousarray(colour[:, :, ::-1]), "bgr8"))
            for kind in ["PNG", "JPEG"]:
                name = f"bgr8; {kind.lower()} compressed bgr8"
                data = packed(Image.fromarray(colour), kind)
                write(f"{topic}/{kind.lower()}/compressed", packed_image, colour_at, format=name, data=data)
        write("/camera/color/small", image, 10_000, height=1, width=2, step=6, encoding="rgb8", is_bigendian=0, data=bytes(6))
        writer.finish()


main(sys.argv[1])
