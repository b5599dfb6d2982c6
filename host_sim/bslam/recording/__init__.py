"""Recordings: all that went into a robot and came out, in order, as one MCAP file.

    for entry in load("drive.mcap").entries: ...        # entries.py: Reading, Frame, Call, State, Map, ...

Foxglove, Lichtblick and PlotJuggler open the file; `bslam replay` runs it again to the same bits.
"""

from bslam.recording.reader import Recording, load
from bslam.recording.recorder import Recorder
from bslam.recording.writer import RecordingWriter

__all__ = ["Recorder", "Recording", "RecordingWriter", "load"]
