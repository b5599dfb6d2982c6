"""Where bytes go to a robot and come back: an emulated board, a serial device, a process of this computer."""

from __future__ import annotations

import hashlib
import json
import os
import re
import select
import shutil
import socket
import subprocess
import tempfile
from pathlib import Path
from typing import Any, Protocol

from bslam.errors import BslamError, did_you_mean

ROOT = Path(__file__).resolve().parents[3]
BUILD_DIR = ROOT / "build"
BOARD_FILES = "firmware/port/*/board.mk"

QEMU = "qemu-system-arm"
TARGET_KINDS = ("qemu", "serial", "process")
ICOUNT = "shift=7,sleep=off"
NS_PER_INSTRUCTION = 128
"""QEMU's clock under ICOUNT: an instruction takes that long, more than a tick, so that ticks count them."""
START_TIMEOUT_S = 30.0
ATTEMPTS = 5


class TargetError(RuntimeError):
    """The robot at the other end went away, started anew, or says what cannot be."""


class Line(Protocol):
    """Bytes both ways. Reads and writes raise TargetError if the other end has gone."""

    @property
    def description(self) -> dict[str, Any]:
        """What is at the other end, for summary.json: "image", "image_sha256" where there is an image."""

    @property
    def ns_per_instruction(self) -> int | None:
        """How long an instruction takes on the target's clock, if that is fixed."""

    @property
    def attempts(self) -> int:
        """How often a message is sent before the robot is taken for gone."""

    def write(self, data: bytes) -> None:
        """Sends all of it."""

    def read(self, timeout_s: float) -> bytes:
        """What has come, at least a byte; nothing after the time-out."""

    def close(self) -> None:
        """Ends it."""


def qemu_machines() -> dict[str, str]:
    """The boards that QEMU has, by their folder's name, and what it calls them: from their board.mk."""
    return _of_boards("QEMU")


def _of_boards(what: str) -> dict[str, str]:
    """BOARD_<what>_<board> of the board.mk that have one."""
    found = {}
    for path in sorted(ROOT.glob(BOARD_FILES)):
        board = path.parent.name
        text = path.read_text(encoding="utf-8")
        match = re.search(rf"^BOARD_{what}_{board} := (\S+)$", text, re.MULTILINE)
        if match:
            found[board] = match[1]
    return found


def emulator_of(board: str) -> str:
    """The program that emulates a board."""
    return _of_boards("EMULATOR").get(board, QEMU)


def boards_here() -> list[str]:
    """QEMU's boards, but for those of other cores than Arm's whose emulator or image is not here: nothing
    installs their tools unasked (docs/PORTING.md).
    """
    others = _of_boards("EMULATOR")
    missing = {
        one for one, program in others.items() if not (shutil.which(program) and _image_of(one).is_file())
    }
    return sorted(set(qemu_machines()) - missing)


def _image_of(board: str, program: str = "robot") -> Path:
    return BUILD_DIR / board / f"{program}.elf"


def how_to_start(board: str) -> list[str]:
    """QEMU's arguments for a program that starts at reset and may end the emulator."""
    if emulator_of(board) != QEMU:
        return ["-bios", "none"]
    return ["-semihosting-config", "enable=on,target=native"]


def film_arguments(board: str, film: Path) -> list[str]:
    """QEMU's arguments to put a film where the board looks for one. Raises BslamError."""
    flags = (ROOT / "firmware" / "port" / board / "board.mk").read_text(encoding="utf-8")
    address = re.search(r"-DFILM_ADDRESS=(0x[0-9a-f]+)u", flags)
    if address is None:
        raise BslamError(f"{board} looks for no film; allowed: boards with FILM_ADDRESS in their board.mk")
    if not film.is_file():
        raise BslamError(f"{film} is missing; allowed: a film, as `tools/proofs/make_film.py` writes it")
    return ["-device", f"loader,file={film},addr={address[1]},force-raw=on"]


def open_line(target: str) -> Line:
    """The line that a word of `--target` names. Raises BslamError if it cannot be: never something else."""
    kind, _, name = target.partition(":")
    if kind == "qemu":
        return QemuLine(name)
    if kind == "serial":
        return SerialLine(name)
    if kind == "process":
        return ProcessLine(Path(name))
    raise BslamError(f"target {no_such_target(target)}")


def no_such_target(target: str) -> str:
    """What an error says of one. qemu:BOARD:FILM is allowed, too, with a film that the robot drives by."""
    boards = [f"qemu:{board}" for board in qemu_machines()]
    here = boards or ["qemu:BOARD (in a clone of bslam, where `make firmware` builds its image)"]
    names = ["host", *here]
    is_port = re.fullmatch(r"/dev/.+|tty\w+|COM\d+", target, re.IGNORECASE) is not None
    near = f"; did you mean 'serial:{target}'?" if is_port else did_you_mean(target, names)
    return f"'{target}' does not exist; allowed: {', '.join(names)}, serial:DEVICE, process:PROGRAM{near}"


class QemuLine:
    """An image in QEMU, its serial line on a socket of ours. The same instructions at every run."""

    ns_per_instruction: int | None = NS_PER_INSTRUCTION
    attempts = 60  # a computer with much to do lets its emulator wait

    def __init__(self, name: str, *more: str) -> None:
        """`name` as in --target: BOARD, BOARD/PROGRAM, each with :FILM; `more` arguments for QEMU."""
        image, _, film = name.partition(":")
        board, _, program = image.partition("/")
        machines = qemu_machines()
        if board not in machines:
            raise BslamError(f"target {no_such_target(f'qemu:{board}')}")
        self._emulator, self._start_words = emulator_of(board), how_to_start(board)
        if shutil.which(self._emulator) is None:
            package = "qemu-system-arm" if self._emulator == QEMU else "qemu-system-misc"
            raise BslamError(
                f"{self._emulator} is not installed: install it with: sudo apt-get install {package}"
            )
        self._image = _image_of(board, program or "robot")
        if not self._image.is_file():
            made_by = f"make {'rtos' if program == 'robot_rtos' else 'firmware'} TARGET={board}"
            raise BslamError(f"{self._image} is missing: build it with: {made_by}")
        self._more = [*more, *(film_arguments(board, Path(film)) if film else [])]
        self._folder = tempfile.TemporaryDirectory(prefix="bslam-")
        self._first = b""
        self._socket, self._process = self._start(machines[board])
        try:
            self._first = self._wait_for_start()
        except BaseException:
            self.close()
            raise

    def _start(self, machine: str) -> tuple[socket.socket, subprocess.Popen[bytes]]:
        path = str(Path(self._folder.name) / "line")
        listener = socket.socket(socket.AF_UNIX)
        listener.bind(path)
        listener.listen(1)
        listener.settimeout(START_TIMEOUT_S)
        command = [
            self._emulator,
            "-M",
            machine,
            "-display",
            "none",
            "-monitor",
            "none",
            "-kernel",
            str(self._image),
        ]
        command += [*self._start_words, "-icount", ICOUNT]
        command += ["-chardev", f"socket,id=line,path={path}", "-serial", "chardev:line"]
        command += ["-qmp", f"unix:{path}.qmp,server=on,wait=off", *self._more]
        process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
        )
        try:
            line, _ = listener.accept()
        except TimeoutError:
            process.kill()
            said = process.communicate()[1].decode(errors="replace")
            raise TargetError(f"{self._emulator} did not start: {said}") from None
        finally:
            listener.close()
        return line, process

    def _wait_for_start(self) -> bytes:
        """A UART drops what comes before the program has enabled it: its first bytes say that it has."""
        data = self.read(START_TIMEOUT_S)
        if not data:
            raise TargetError(f"{self._image} on {self._emulator} says nothing")
        return data

    @property
    def description(self) -> dict[str, Any]:
        return _image_description(self._image)

    def write(self, data: bytes) -> None:
        try:
            self._socket.settimeout(START_TIMEOUT_S)  # not the last read's: an emulator may be slow
            self._socket.sendall(data)
        except OSError as error:
            raise TargetError(self._gone()) from error

    def read(self, timeout_s: float) -> bytes:
        first, self._first = self._first, b""
        return first or _receive(self._socket, timeout_s, self._gone)

    def restart(self) -> None:
        """Press the board's reset button: the program starts anew, RAM and flash are as they were."""
        self.monitor("system_reset", until=b'"RESET"')

    def monitor(self, command: str, until: bytes = b'"return": "', **words: str) -> str:
        """A command to the emulator itself (QMP); what it said up to the end of its answer."""
        asked = json.dumps({"execute": command, "arguments": words})
        with socket.socket(socket.AF_UNIX) as monitor:
            monitor.connect(str(Path(self._folder.name) / "line.qmp"))
            monitor.sendall(b'{"execute": "qmp_capabilities"} ' + asked.encode())
            said = b""
            while until not in said or not said.endswith(b"\n"):
                said += _receive(monitor, START_TIMEOUT_S, self._gone)
        return said.decode()

    @property
    def process_id(self) -> int:
        """Of the emulator."""
        return self._process.pid

    def _gone(self) -> str:
        self._process.kill()
        said = self._process.communicate()[1].decode(errors="replace").strip()
        return (
            f"{self._emulator} with {self._image.name} ended with status {self._process.returncode}: {said}"
        )

    def close(self) -> None:
        self._socket.close()
        self._process.kill()
        self._process.wait()
        assert self._process.stderr is not None
        self._process.stderr.close()
        self._folder.cleanup()


class ProcessLine:
    """A program that speaks the link on its standard input and output: the application on this computer."""

    ns_per_instruction: int | None = None
    attempts = ATTEMPTS

    def __init__(self, program: Path) -> None:
        if not program.is_file():
            raise BslamError(f"{program} is missing; allowed: a program that speaks the link")
        self._program = program
        self._process = subprocess.Popen(
            [str(program)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0
        )

    @property
    def description(self) -> dict[str, Any]:
        return _image_description(self._program)

    def write(self, data: bytes) -> None:
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(data)
        except OSError as error:
            raise TargetError(self._gone()) from error

    def read(self, timeout_s: float) -> bytes:
        assert self._process.stdout is not None
        ready, _, _ = select.select([self._process.stdout], [], [], timeout_s)
        if not ready:
            return b""
        data = os.read(self._process.stdout.fileno(), 1 << 16)
        if not data:
            raise TargetError(self._gone())
        return data

    def _gone(self) -> str:
        self._process.kill()
        return f"{self._program.name} ended with status {self._process.wait()}"

    def close(self) -> None:
        self._process.kill()
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                pipe.close()
        self._process.wait()


class SerialLine:
    """A serial device, a robot at its other end."""

    ns_per_instruction: int | None = None
    attempts = ATTEMPTS
    BAUD = 115200
    WRITE_TIMEOUT_S = 5.0  # of a device that takes nothing more

    def __init__(self, device: str) -> None:
        import serial  # here, since it takes time and few need it

        try:
            self._serial = serial.serial_for_url(
                device, baudrate=self.BAUD, timeout=0.1, write_timeout=self.WRITE_TIMEOUT_S
            )
        except (serial.SerialException, ValueError) as error:
            allowed = "allowed: a device such as /dev/ttyUSB0"
            raise BslamError(f"serial device '{device}': {error}; {allowed}") from error
        self._device = device
        self._gone: type[Exception] = serial.SerialException

    @property
    def description(self) -> dict[str, Any]:
        return {"device": self._device}

    def write(self, data: bytes) -> None:
        try:
            self._serial.write(data)
        except self._gone as error:
            raise TargetError(f"{self._device}: {error}") from error

    def read(self, timeout_s: float) -> bytes:
        try:
            self._serial.timeout = timeout_s
            return bytes(self._serial.read(max(1, self._serial.in_waiting)))
        except self._gone as error:
            raise TargetError(f"{self._device}: {error}") from error

    def close(self) -> None:
        self._serial.close()


def _receive(line: socket.socket, timeout_s: float, gone: Any) -> bytes:
    line.settimeout(timeout_s)
    try:
        data = line.recv(1 << 16)
    except TimeoutError:
        return b""
    except OSError as error:
        raise TargetError(gone()) from error
    if not data:
        raise TargetError(gone())
    return data


def _image_description(path: Path) -> dict[str, Any]:
    return {
        "image": f"{path.parent.name}/{path.name}",
        "image_sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
    }
