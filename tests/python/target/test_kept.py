"""Parameters in a board's flash: kept over a reset in QEMU, as far as QEMU has the flash."""

import binascii
import struct

import numpy as np
import pytest

from bslam.core.slam import Slam
from bslam.link.frames import crc16
from bslam.target.lines import QemuLine, TargetError
from bslam.target.remote import RemoteSlam

FIRST_SECTOR = 0x080C0000
"""As in firmware/port/stm32f405/flash.c."""


def test_a_board_s_parameters_outlast_its_resets():
    line = QemuLine("microbit")
    with RemoteSlam(line, None, 6) as robot:
        for wheelbase_m in (0.31, 0.27, 0.29):
            robot.set_param("wheelbase_m", wheelbase_m)
            robot.save_params()
            line.restart()
            with pytest.raises(TargetError, match="started anew"):
                robot.update()
            robot = RemoteSlam(line, None, 6)
            assert robot.params["wheelbase_m"] == pytest.approx(wheelbase_m)
            assert robot.params["gate_d2"] == np.float32(Slam.defaults()["gate_d2"])


def kept(values, sequence):
    """A slot of flash with parameters in it: firmware/app/stored.c in firmware/port/kept.c."""
    names = b"".join(p.name.encode() + b"\0" for p in Slam.parameters())
    content = np.array(list(values.values()), "<f4").tobytes() + struct.pack("<H", crc16(names))
    content += struct.pack("<H", crc16(content))
    numbers = struct.pack("<II", sequence, len(content))
    return b"KEPT" + numbers + struct.pack("<I", binascii.crc32(numbers + content)) + content


def test_the_stm32f405_loads_the_newer_of_its_sectors_and_says_that_qemu_s_cannot_be_written(tmp_path):
    more = []
    for slot, wheelbase_m in enumerate((0.25, 0.35)):
        path = tmp_path / f"slot{slot}"
        path.write_bytes(kept(Slam.defaults() | {"wheelbase_m": wheelbase_m}, slot + 7))
        more += ["-device", f"loader,file={path},addr={FIRST_SECTOR + slot * 0x20000:#x},force-raw=on"]
    with RemoteSlam(QemuLine("stm32f405", *more), None, 6) as robot:
        assert robot.params["wheelbase_m"] == pytest.approx(0.35)
        with pytest.raises(TargetError, match="STORE"):
            robot.save_params()
