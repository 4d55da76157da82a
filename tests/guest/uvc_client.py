#!/usr/bin/env python3
"""Software that knows a camera by V4L2 alone, and closes its loop over the extension unit of
drivers/uvc_protocol.md:

    uvc_client.py NODE WIDTH FRAMES
    uvc_client.py NODE turned X Y          waits until its trim is that, in nanoradians, to one in a hundred

Reads frames in Y16 that have a telemetry row, asks the camera what it knows of each, answers each with a trim, and sees
the camera turn. Prints what it found; exit code 0: all of it was right.
"""
import ctypes
import errno
import fcntl
import mmap
import os
import struct
import sys
import time

SET_CUR, GET_CUR, GET_MIN, GET_MAX, GET_LEN, GET_INFO = 0x01, 0x81, 0x82, 0x83, 0x85, 0x86
UNIT = 2
COMMAND, FRAME, SELECT, COUNTS = 1, 2, 3, 4
NONE = 2**64 - 1


def ioctl_number(direction: int, kind: str, number: int, size: int) -> int:
    return direction << 30 | size << 16 | ord(kind) << 8 | number


class XuQuery(ctypes.Structure):
    """struct uvc_xu_control_query"""
    _fields_ = [("unit", ctypes.c_uint8), ("selector", ctypes.c_uint8), ("query", ctypes.c_uint8),
                ("size", ctypes.c_uint16), ("data", ctypes.c_void_p)]


UVCIOC_CTRL_QUERY = ioctl_number(3, "u", 0x21, ctypes.sizeof(XuQuery))


class V4l2Buffer(ctypes.Structure):
    """struct v4l2_buffer"""
    _fields_ = [("index", ctypes.c_uint32), ("type", ctypes.c_uint32), ("bytesused", ctypes.c_uint32),
                ("flags", ctypes.c_uint32), ("field", ctypes.c_uint32), ("seconds", ctypes.c_int64),
                ("useconds", ctypes.c_int64), ("timecode", ctypes.c_uint32 * 4), ("sequence", ctypes.c_uint32),
                ("memory", ctypes.c_uint32), ("offset", ctypes.c_uint64), ("length", ctypes.c_uint32),
                ("reserved2", ctypes.c_uint32), ("request", ctypes.c_uint32), ("padding", ctypes.c_uint32)]


CAPTURE, MMAP = 1, 1
QUERYBUF, QBUF, DQBUF = (ioctl_number(3, "V", n, ctypes.sizeof(V4l2Buffer)) for n in (9, 15, 17))
REQBUFS = ioctl_number(3, "V", 8, 20)
STREAMON, STREAMOFF = (ioctl_number(1, "V", n, 4) for n in (18, 19))


class Camera:
    def __init__(self, node: str) -> None:
        self.file = os.open(node, os.O_RDWR)
        self.buffers = []

    def query(self, selector: int, query: int, data: bytes) -> bytes:
        memory = ctypes.create_string_buffer(data, len(data))
        ask = XuQuery(UNIT, selector, query, len(data), ctypes.addressof(memory))
        fcntl.ioctl(self.file, UVCIOC_CTRL_QUERY, ask)
        return memory.raw

    def refused(self, selector: int, query: int, data: bytes) -> int:
        try:
            self.query(selector, query, data)
        except OSError as error:
            return error.errno
        return 0

    def frame(self, sequence: int) -> tuple:
        self.query(SELECT, SET_CUR, struct.pack("<Q", sequence))
        return struct.unpack("<Qqqii4i3iBBHQ", self.query(FRAME, GET_CUR, bytes(72)))

    def counts(self) -> tuple:
        return struct.unpack("<16Q", self.query(COUNTS, GET_CUR, bytes(128)))

    def buffer(self, index: int = 0) -> V4l2Buffer:
        return V4l2Buffer(index=index, type=CAPTURE, memory=MMAP)

    def start(self) -> None:
        fcntl.ioctl(self.file, REQBUFS, bytearray(struct.pack("<5I", 4, CAPTURE, MMAP, 0, 0)))
        for index in range(4):
            b = self.buffer(index)
            fcntl.ioctl(self.file, QUERYBUF, b)
            self.buffers.append(mmap.mmap(self.file, b.length, offset=b.offset & 0xFFFFFFFF))
            fcntl.ioctl(self.file, QBUF, b)
        fcntl.ioctl(self.file, STREAMON, struct.pack("<i", CAPTURE))

    def stop(self) -> None:
        fcntl.ioctl(self.file, STREAMOFF, struct.pack("<i", CAPTURE))


def command(sequence: int, answers: int, when_ns: int, offset_nrad: tuple) -> bytes:
    trim = 1
    return struct.pack("<BBBBIQQqq4i2iIHH", 1, trim, 0, 0, 0, sequence, answers, when_ns, when_ns,
                       *offset_nrad, 0, 0, 0, 0, 0, 0, 0)


def expect(what: str, got, wanted) -> None:
    if got != wanted:
        sys.exit(f"{what}: {got}, and not {wanted}")


def has_turned(camera: Camera, wanted: list) -> int:
    end = time.monotonic() + 30
    trim = None
    while time.monotonic() < end:
        trim = camera.frame(NONE)[3:5]
        if all(abs(t - w) <= abs(w) / 100 for t, w in zip(trim, wanted)):
            print(f"turned to {trim} nrad")
            return 0
        time.sleep(0.05)
    sys.exit(f"not turned to {wanted} nrad: {trim}")


def main() -> int:
    camera = Camera(sys.argv[1])
    if sys.argv[2] == "turned":
        return has_turned(camera, [int(word) for word in sys.argv[3:]])
    width, frames = int(sys.argv[2]), int(sys.argv[3])
    # What the driver asks of each control before it lets anybody use it.
    for selector, size in ((COMMAND, 72), (FRAME, 72), (SELECT, 8), (COUNTS, 128)):
        expect("length", struct.unpack("<H", camera.query(selector, GET_LEN, bytes(2)))[0], size)
    least = struct.unpack_from("<4i", camera.query(COMMAND, GET_MIN, bytes(72)), 40)
    expect("least angles", least, (-2**31,) * 4)
    expect("a command that is none", camera.refused(COMMAND, SET_CUR, bytes(72)), errno.ERANGE)
    expect("news may not be set", camera.refused(FRAME, SET_CUR, bytes(72)) in (errno.EACCES, errno.EBADRQC), True)

    camera.start()
    matched = 0
    wanted = (20_000, -10_000)  # nanoradians
    seen = 0
    for n in range(frames):
        b = camera.buffer()
        fcntl.ioctl(camera.file, DQBUF, b)
        row = camera.buffers[b.index][b.bytesused - 2 * width:b.bytesused:2]
        expect("telemetry row", row[:4], b"SLTR")
        number = camera.counts()[12] + b.sequence
        expect("the frame's number", number, int.from_bytes(row[8:16], "little"))
        news = camera.frame(number)
        expect("what is known of the frame", news[:2], (number, int.from_bytes(row[16:24], "little")))
        matched += 1
        camera.query(COMMAND, SET_CUR, command(n, number, news[1] + news[2], wanted))
        if abs(news[3] - wanted[0]) < 500 and abs(news[4] - wanted[1]) < 500:
            seen += 1
        fcntl.ioctl(camera.file, QBUF, b)
    camera.stop()
    counts = camera.counts()
    expect("counts that add up", counts[0], sum(counts[1:6]))
    expect("the last command", counts[11], frames - 1)
    end = time.monotonic() + 20
    while camera.frame(NONE)[15] == 0 and time.monotonic() < end:
        time.sleep(0.1)
    newest = camera.frame(NONE)
    print(f"matched={matched} turned={seen} sent={counts[2]} overtaken={counts[3]} missed={counts[6]} "
          f"commands={counts[8]} lost={counts[9]} obeyed={newest[15]} trim_nrad={newest[3]},{newest[4]}")
    return 0 if seen > 0 and newest[15] > 0 else 1


if __name__ == "__main__":
    sys.exit(main())
