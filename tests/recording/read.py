"""Reads recordings with mcap and mcap-protobuf-support, by the schemas in the files, and holds their messages against one another."""

import json
import math
import sys
from collections import Counter, defaultdict
from pathlib import Path

from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

# Points are f32 of some metres [m].
ROUNDING = 2e-6
# Depths are whole millimetres [m].
PER_METRE = 1000
KINDS = {"object": dict, "array": list, "string": str, "boolean": bool, "integer": int, "number": (int, float)}


def check_json(value, schema, where):
    """What of JSON Schema our schemas use."""
    assert isinstance(value, KINDS[schema["type"]]), f"{where}: {value!r} is no {schema['type']}"
    if schema["type"] == "object":
        missing = set(schema.get("required", [])) - value.keys()
        unknown = value.keys() - schema["properties"].keys()
        assert not missing and not unknown, f"{where}: without {missing}, with {unknown}"
        for name, field in value.items():
            check_json(field, schema["properties"][name], f"{where}.{name}")
    if schema["type"] == "array":
        assert schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", len(value)), where
        for item in value:
            check_json(item, schema["items"], where)


def read(path):
    """All messages, decoded by the schemas in the file: topic -> [(time, message)]; attachments and metadata."""
    messages, factory, last = defaultdict(list), DecoderFactory(), 0
    with open(path, "rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            assert message.log_time >= last, f"{channel.topic}: time goes back to {message.log_time}"
            assert message.publish_time == message.log_time
            last = message.log_time
            if channel.message_encoding == "json":
                assert schema.encoding == "jsonschema"
                decoded = json.loads(message.data)
                check_json(decoded, json.loads(schema.data), channel.topic)
            else:
                assert (channel.message_encoding, schema.encoding) == ("protobuf", "protobuf")
                decoded = factory.decoder_for("protobuf", schema)(message.data)
                assert schema.name == f"foxglove.{type(decoded).__name__}", schema.name
            messages[channel.topic].append((message.log_time, decoded))
        attachments = {a.name: json.loads(a.data) for a in reader.iter_attachments()}
        metadata = {m.name: m.metadata for m in reader.iter_metadata()}
    told = {summary.channels[i].topic: n for i, n in summary.statistics.channel_message_counts.items()}
    assert told == {topic: len(list) for topic, list in messages.items()}, "the summary's counts"
    topics = {channel.topic for channel in summary.channels.values()}
    return messages, topics, attachments, metadata


def nanoseconds(stamp):
    return stamp.seconds * 10**9 + stamp.nanos


def rotate(q, p):
    """Turns a point by a unit quaternion."""
    t = [2 * (q.y * p[2] - q.z * p[1]), 2 * (q.z * p[0] - q.x * p[2]), 2 * (q.x * p[1] - q.y * p[0])]
    return [
        p[0] + q.w * t[0] + q.y * t[2] - q.z * t[1],
        p[1] + q.w * t[1] + q.z * t[0] - q.x * t[2],
        p[2] + q.w * t[2] + q.x * t[1] - q.y * t[0],
    ]


def follow(messages):
    """Poses by frame at every time of /tf: (time, {frame: transform})."""
    poses = {}
    for time, message in messages["/tf"]:
        for transform in message.transforms:
            assert nanoseconds(transform.timestamp) == time
            assert transform.parent_frame_id == "world"
            q = transform.rotation
            assert abs(math.hypot(q.x, q.y, q.z, q.w) - 1) < 1e-9, transform.child_frame_id
            poses[transform.child_frame_id] = transform
        yield time, dict(poses)


def check_frames(messages, poses):
    """Whatever is drawn stands in a frame that has a pose by then."""
    first = poses[0][1]
    used = Counter()
    for topic in messages:
        for time, message in messages[topic]:
            frames = [e.frame_id for e in message.entities] if topic.startswith("/scene/") else []
            if topic.startswith("/camera/"):
                frames = [message.frame_id]
            for frame in frames:
                assert frame == "world" or frame in first, f"{topic}: frame {frame} has no pose"
                used[frame] += 1
    assert used["camera"] and used["segment/0"] and used["fruit/0"]


def check_scene(messages, record):
    for topic in ("/scene/ground", "/scene/wood", "/scene/leaves", "/scene/fruit", "/scene/robot"):
        assert messages[topic][0][0] == 0, f"{topic} begins late"
    for topic in messages:
        if topic.startswith("/scene/"):
            for _, message in messages[topic]:
                # Everything before is replaced.
                assert [d.type for d in message.deletions] == [1], topic
                ids = [e.id for e in message.entities]
                assert len(ids) == len(set(ids)), topic
    fruit = messages["/scene/fruit"][0][1].entities
    assert len(fruit) == record["fruit_total"]
    for entity, told in zip(fruit, record["fruit"]):
        assert abs(entity.spheres[0].size.x - 2 * told["radius"]) < 1e-12


def check_camera(messages, poses, record, case):
    at = dict(poses)
    width, height, stride = case["width"], case["height"], case["stride"]
    fx, fy, cx, cy = (case[name] for name in ("fx", "fy", "cx", "cy"))
    depths, clouds = messages["/camera/depth"], messages["/camera/points"]
    cameras = messages["/camera/calibration"]
    assert len(depths) == len(clouds) == len(cameras) > 0
    on_fruit = 0
    for (time, depth), (_, cloud), (_, camera) in zip(depths, clouds, cameras):
        taken = nanoseconds(depth.timestamp)
        assert taken <= time and nanoseconds(cloud.timestamp) == nanoseconds(camera.timestamp) == taken
        assert (depth.width, depth.height, depth.encoding) == (width, height, "16UC1")
        assert depth.step == 2 * width and len(depth.data) == depth.step * height
        assert (camera.width, camera.height) == (width, height)
        assert list(camera.K) == [fx, 0, cx, 0, fy, cy, 0, 0, 1]
        assert list(camera.P) == [fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0]
        image = memoryview(depth.data).cast("H")
        assert [(f.name, f.offset, f.type) for f in cloud.fields] == [("x", 0, 7), ("y", 4, 7), ("z", 8, 7)]
        assert cloud.point_stride == 12 and len(cloud.data) % 12 == 0
        points = memoryview(cloud.data).cast("f")
        grid = [(u, v) for v in range(0, height, stride) for u in range(0, width, stride)]
        seen = [(u, v) for u, v in grid if image[v * width + u] > 0]
        assert len(seen) == len(points) // 3
        pose = at[taken]["camera"]
        t = pose.translation
        # Every second all poses are kept; in between, fruit that moved no farther than this were not.
        near = ROUNDING if taken % 10**9 == 0 else case["still"] + ROUNDING
        fruit = [at[taken][f"fruit/{f['id']}"].translation for f in record["fruit"]]
        for i, (u, v) in enumerate(seen):
            x, y, z = points[3 * i : 3 * i + 3]
            # To the nearest, and f32 arithmetic.
            assert abs(PER_METRE * z - image[v * width + u]) <= 0.5 + 1e-3
            assert abs(fx * x / z + cx - u) < 1e-4 and abs(fy * y / z + cy - v) < 1e-4
            p = [a + b for a, b in zip(rotate(pose.rotation, (x, y, z)), (t.x, t.y, t.z))]
            for told, c in zip(record["fruit"], fruit):
                off = math.dist(p, (c.x, c.y, c.z)) - told["radius"]
                # Nothing is seen within a fruit; what is seen of it lies on its skin.
                assert off > -near, f"a point {off} m within fruit {told['id']} at {taken} ns"
                on_fruit += off < near
    assert on_fruit > 0, "no point lies on a fruit"


def check_robot(messages, record, case):
    frames = record["frames"]
    joints = messages["/joint_states"]
    assert len(joints) == frames == case["frames"]
    names = [joint.name for joint in joints[0][1].joints]
    assert len(names) == len(set(names)) == 13
    step = 10**9 / 60
    for k, (time, message) in enumerate(joints):
        assert time == round(k * step) == nanoseconds(message.timestamp)
        assert [joint.name for joint in message.joints] == names
    commands = messages["/command"]
    assert len(commands) >= frames, "settling adds frames, nothing takes them"
    assert [time for time, _ in commands] == [round(k * step) for k in range(len(commands))]
    assert [name for name in names if name.startswith("fr3_joint")] == [f"fr3_joint{i}" for i in range(1, 8)]
    # Nothing tells a joint's velocity or effort that no sensor has.
    told = [(joint.HasField("velocity"), joint.HasField("effort")) for joint in joints[0][1].joints]
    assert told == [(True, False)] * 3 + [(False, False)] + [(True, True)] * 7 + [(False, True)] * 2
    hashes = messages["/state_hash"]
    assert [message["frame"] for _, message in hashes] == list(range(len(commands) + 1))
    assert all(len(message["sha256"]) == 64 for _, message in hashes)
    assert len({message["sha256"] for _, message in hashes}) == len(hashes), "two states are one"


def check_record(messages, record, poses):
    first = poses[0][1]
    for fruit in record["fruit"]:
        p = first[f"fruit/{fruit['id']}"].translation
        assert [p.x, p.y, p.z] == fruit["p_world"], f"fruit {fruit['id']}"
    events = [(e["event"], e.get("fruit", e.get("segment")), t) for t, e in messages.get("/events", [])]
    for name, list_name, of in (
        ("fruit_detached", "fruit_detached", "fruit"),
        ("fruit_deposited", "fruit_deposited", "fruit"),
        ("fruit_dropped", "fruit_dropped", "fruit"),
        ("branch_snapped", "branches_snapped", "segment"),
    ):
        told = [(e[of], round(e["time"] * 1e9)) for e in record[list_name]]
        assert [(i, t) for event, i, t in events if event == name] == told, name
    notes = [(m, t) for t, m in messages.get("/picker", [])]
    starts = [t for m, t in notes if m["event"] == "attempt_started"]
    assert starts == [round(a["start_time"] * 1e9) for a in record["attempts"]]
    assert len(messages["/detections"]) == len(messages["/scene/detections"]) == record["detection"]["images"]
    found = sum(len(m["detections"]) for _, m in messages["/detections"])
    tally = record["detection"]
    assert found == tally["true_positives"] + tally["false_positives"]
    # Contacts of the fingers come too often for the log.
    told = [event for event, _, _ in events if not event.startswith("finger_contact_")]
    assert len(messages.get("/log", [])) == len(told) + len(notes)
    began = [i for event, i, _ in events if event == "finger_contact_began"]
    assert {a["fruit"] for a in record["contact_attempts"]} <= set(began)


def topics_of(value):
    if isinstance(value, str):
        return {value.split(".")[0].split("[")[0]} if value.startswith("/") else set()
    if isinstance(value, dict):
        return set().union(*map(topics_of, value), *map(topics_of, value.values()))
    return set().union(*map(topics_of, value)) if isinstance(value, list) else set()


def main():
    for name in sys.argv[1:]:
        case = json.loads(Path(name).read_text())
        messages, topics, attachments, metadata = read(case["file"])
        assert topics == set(case["topics"]), topics ^ set(case["topics"])
        assert topics_of(json.loads(Path(case["layout"]).read_text())) <= topics
        record = attachments["episode.json"]
        key = json.loads(metadata["orchardbench.episode"]["key"])
        assert key.items() <= record.items(), "the key"
        poses = list(follow(messages))
        assert poses[0][0] == 0
        check_frames(messages, poses)
        check_scene(messages, record)
        check_camera(messages, poses, record, case)
        check_robot(messages, record, case)
        check_record(messages, record, poses)
        total = sum(map(len, messages.values()))
        events = len(messages.get("/events", []))
        print(f"{Path(case['file']).name}: {total} messages on {len(messages)} channels, {events} events: agree")


main()
