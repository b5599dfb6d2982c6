"""JSON schemas of the topics, as viewers want them: `bslam.*` are our own, `foxglove.*` known to them."""

from __future__ import annotations

from bslam.log import ODOMETRY_COLUMNS
from bslam.recording.entries import Json

_NUMBER: Json = {"type": "number"}
_WHOLE: Json = {"type": "integer"}
_TEXT: Json = {"type": "string"}
_BOOL: Json = {"type": "boolean"}


def _object(title: str = "", /, **properties: Json) -> Json:
    return {**({"title": title} if title else {}), "type": "object", "properties": properties}


def _list(items: Json) -> Json:
    return {"type": "array", "items": items}


_TIME = _object("time", sec=_WHOLE, nsec=_WHOLE)
_VECTOR = _object("foxglove.Vector3", x=_NUMBER, y=_NUMBER, z=_NUMBER)
_QUATERNION = _object("foxglove.Quaternion", x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER)
_POSE = _object("foxglove.Pose", position=_VECTOR, orientation=_QUATERNION)
_COLOR = _object("foxglove.Color", r=_NUMBER, g=_NUMBER, b=_NUMBER, a=_NUMBER)
_CYLINDER = _object(
    "foxglove.CylinderPrimitive",
    pose=_POSE,
    size=_VECTOR,
    bottom_scale=_NUMBER,
    top_scale=_NUMBER,
    color=_COLOR,
)
_LABEL = _object(
    "foxglove.TextPrimitive",
    pose=_POSE,
    billboard=_BOOL,
    font_size=_NUMBER,
    scale_invariant=_BOOL,
    color=_COLOR,
    text=_TEXT,
)
_ENTITY = _object(
    "foxglove.SceneEntity",
    timestamp=_TIME,
    frame_id=_TEXT,
    id=_TEXT,
    lifetime=_object("duration", sec=_WHOLE, nsec=_WHOLE),
    frame_locked=_BOOL,
    metadata=_list(_object("foxglove.KeyValuePair", key=_TEXT, value=_TEXT)),
    cylinders=_list(_CYLINDER),
    texts=_list(_LABEL),
    **{name: _list(_object()) for name in ("arrows", "cubes", "spheres", "lines", "triangles", "models")},
)
_DELETION = _object("foxglove.SceneEntityDeletion", timestamp=_TIME, type=_WHOLE, id=_TEXT)
_ACCOUNT = _object(result=_TEXT, reason=_TEXT, beacon_uid=_WHOLE, test_ratio=_NUMBER, weight=_NUMBER)
_SIGHTING = _object(
    bearing_rad=_NUMBER,
    range_m=_NUMBER,
    label=_WHOLE,
    mappable=_BOOL,
    bearing_sd_rad=_NUMBER,
    range_sd_m=_NUMBER,
    range_scale_sd=_NUMBER,
    score=_NUMBER,
    signature=_TEXT,
    beacon_class=_WHOLE,
    true_id=_WHOLE,
    account=_ACCOUNT,
)
_BEACON = _object(
    uid=_WHOLE,
    label=_WHOLE,
    kind=_TEXT,
    confirmed=_BOOL,
    sightings=_WHOLE,
    x_m=_NUMBER,
    y_m=_NUMBER,
    covariance=_list(_list(_NUMBER)),
    range_m=_NUMBER,
    phi_rad=_NUMBER,
)
_POSE_2D = {"time_us": _WHOLE, "x_m": _NUMBER, "y_m": _NUMBER, "theta_rad": _NUMBER}

SCHEMAS: dict[str, Json] = {
    "bslam.Start": _object(
        name=_TEXT,
        params=_object(),
        beacons_max=_WHOLE,
        words=_list(_TEXT),
        seeds=_TEXT,
        real=_TEXT,
        kept_map=_TEXT,
        frozen=_BOOL,
        about=_object(),
    ),
    "bslam.Odometry": _object(
        time_us=_WHOLE,
        kind=_TEXT,
        gyro_radps=_NUMBER,
        gyro_sd_radps=_NUMBER,
        refused=_TEXT,
        **{name: _NUMBER for names in ODOMETRY_COLUMNS.values() for name in names},
    ),
    "bslam.Sightings": _object(
        time_us=_WHOLE, refused=_TEXT, signed=_BOOL, numbers=_list(_TEXT), sightings=_list(_SIGHTING)
    ),
    "bslam.Call": _object(
        name=_TEXT, arguments=_list({"type": ["number", "string"]}), refused=_TEXT, words=_object()
    ),
    "bslam.State": _object(**_POSE_2D, covariance=_list(_NUMBER), fingerprint=_TEXT),
    "bslam.Map": _object(beacons=_list(_BEACON)),
    "bslam.Counters": _object(),
    "bslam.TruePose": _object(**_POSE_2D),
    "bslam.Gap": _object(lost=_WHOLE),
    "foxglove.PoseInFrame": _object(timestamp=_TIME, frame_id=_TEXT, pose=_POSE),
    "foxglove.SceneUpdate": _object(deletions=_list(_DELETION), entities=_list(_ENTITY)),
}
for _name, _schema in SCHEMAS.items():
    _schema["title"] = _name
