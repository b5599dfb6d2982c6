"""What recordings hold for viewers is what Foxglove has published: its own definitions, by its package."""

import json

import pytest
from foxglove_schemas_protobuf import PoseInFrame_pb2, SceneUpdate_pb2
from google.protobuf.descriptor import FieldDescriptor as Field
from google.protobuf.json_format import ParseDict
from mcap.reader import make_reader

from bslam.log import first_steps
from bslam.options import RunOptions
from bslam.recording.schemas import SCHEMAS
from bslam.runs.runner import run_log
from bslam.world.simulate import load_scenario, simulate

PUBLISHED = {
    "foxglove.PoseInFrame": PoseInFrame_pb2.PoseInFrame,
    "foxglove.SceneUpdate": SceneUpdate_pb2.SceneUpdate,
}
TIMES = ("google.protobuf.Timestamp", "google.protobuf.Duration")
KINDS = {
    Field.TYPE_DOUBLE: "number",
    Field.TYPE_STRING: "string",
    Field.TYPE_BOOL: "boolean",
    Field.TYPE_ENUM: "integer",
}


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("recording") / "drive.mcap"
    run_log(first_steps(simulate(load_scenario("paper_room"), 3), 120), RunOptions(), record=path)
    return path


def properties_of(schema, descriptor):
    """Holds a JSON schema against a definition, all the way down; what has no properties stays empty."""
    assert schema["type"] == "object"
    if not schema["properties"]:
        return
    if descriptor.full_name in TIMES:  # Foxglove's own JSON schemas have them so
        assert {name: one["type"] for name, one in schema["properties"].items()} == dict.fromkeys(
            ("sec", "nsec"), "integer"
        )
        return
    assert set(schema["properties"]) == {field.name for field in descriptor.fields}
    for field in descriptor.fields:
        inner = schema["properties"][field.name]
        if field.is_repeated:
            assert inner["type"] == "array"
            inner = inner["items"]
        if field.type == Field.TYPE_MESSAGE:
            properties_of(inner, field.message_type)
        else:
            assert inner["type"] == KINDS[field.type], field.full_name


@pytest.mark.parametrize("name", PUBLISHED)
def test_a_schema_has_the_fields_and_types_that_foxglove_has_published(name):
    assert SCHEMAS[name]["title"] == name == PUBLISHED[name].DESCRIPTOR.full_name
    properties_of(SCHEMAS[name], PUBLISHED[name].DESCRIPTOR)


def test_the_summary_that_plotjuggler_begins_with_is_there(recording):
    """It reads no file without one, and takes a channel by its encoding, json, and the schema's number."""
    with recording.open("rb") as file:
        summary = make_reader(file).get_summary()
    counts = summary.statistics.channel_message_counts
    assert summary.statistics.message_count == sum(counts.values()) > 0
    assert set(counts) == set(summary.channels) and summary.chunk_indexes
    assert all(one.schema_id in summary.schemas for one in summary.channels.values())
    assert {one.message_encoding for one in summary.channels.values()} == {"json"}


def with_proto_times(value):
    """Times as protobuf's JSON has them."""
    if isinstance(value, list):
        return [with_proto_times(one) for one in value]
    if not isinstance(value, dict):
        return value
    if set(value) == {"sec", "nsec"}:
        assert 0 <= value["nsec"] < 10**9
        return f"{value['sec']}.{value['nsec']:09d}s"
    found = {name: with_proto_times(one) for name, one in value.items()}
    if "timestamp" in found:
        sec, nsec = value["timestamp"]["sec"], value["timestamp"]["nsec"]
        assert sec < 86_400
        found["timestamp"] = f"1970-01-01T{sec // 3600:02d}:{sec // 60 % 60:02d}:{sec % 60:02d}.{nsec:09d}Z"
    return found


def test_each_message_for_a_viewer_is_taken_by_foxglove_s_own_definition(recording):
    taken = dict.fromkeys(PUBLISHED, 0)
    with recording.open("rb") as file:
        for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            if schema.name in PUBLISHED:
                assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
                ParseDict(with_proto_times(json.loads(message.data)), PUBLISHED[schema.name]())
                taken[schema.name] += 1
    assert all(count > 1 for count in taken.values())
