"""Software under test in Python: frames of a simulated camera as numpy arrays, commands back.

    import starloop_client as starloop

    with starloop.Camera("starloop", timeout_s=10) as camera:
        for frame in camera.frames(timeout_s=10):      # ends when the camera is gone
            answer = frame.answer(centroid_px=(u, v), confidence=1.0)
            camera.send_trim(offset_rad, rate_rad_s, frame.middle_ns, answer)

`frame.pixels` is the shared memory itself, read-only: nothing is copied, and what it shows is the
frame's until the frame is released (here: until the next turn of the loop). Copy what you keep.

Threads: one waits for frames and releases them; one, the same or another, sends.

The C library is looked for in this order: the file that $STARLOOP_CLIENT_LIBRARY names; beside this
module; in the lib folder of the prefix that this module is installed in; where the system looks.
"""

import ctypes
import ctypes.util
import os
import pathlib

import numpy

NO_FRAME = 2**64 - 1
PREDICTED_TARGET, NADIR, INERTIAL, COMMANDED = range(4)


class Error(Exception):
    """What a call found wrong; the text says what."""


class Timeout(Error):
    """Nothing happened in time."""


class Busy(Error):
    """Another reader has the link, or the camera has not taken the last commands."""


class Disconnected(Error):
    """The camera is gone, or was never there."""


class Rejected(Error):
    """What was given, or what came, is not what it should be."""


_ERRORS = {1: Timeout, 2: Busy, 3: Disconnected, 4: Rejected}


class _Frame(ctypes.Structure):
    _fields_ = [
        ("sequence", ctypes.c_uint64), ("shutter_open_ns", ctypes.c_int64),
        ("exposure_ns", ctypes.c_int64), ("width_px", ctypes.c_int32),
        ("height_px", ctypes.c_int32), ("bits", ctypes.c_int32), ("slot", ctypes.c_uint32),
        ("pixels", ctypes.c_void_p), ("telemetry_row", ctypes.c_void_p),
        ("trim_rad", ctypes.c_double * 2), ("j2000_to_camera", ctypes.c_double * 4),
        ("rate_rad_s", ctypes.c_double * 3), ("skipped", ctypes.c_uint64),
        ("dropped", ctypes.c_uint64), ("late", ctypes.c_uint64), ("commands", ctypes.c_uint64),
        ("link_lost", ctypes.c_uint64), ("payload_crc32c", ctypes.c_uint32),
        ("payload_bytes", ctypes.c_uint32)]


class Detection(ctypes.Structure):
    _fields_ = [("centroid_px", ctypes.c_float * 2), ("confidence", ctypes.c_float),
                ("id", ctypes.c_uint32), ("box_px", ctypes.c_float * 4)]


class Answer(ctypes.Structure):
    """What every command carries besides itself."""
    _fields_ = [("answers_frame", ctypes.c_uint64), ("made_at_ns", ctypes.c_int64),
                ("time_to_live_ns", ctypes.c_int64), ("more_follow", ctypes.c_int32),
                ("detection", Detection)]


def _load():
    here = pathlib.Path(__file__).resolve().parent
    name = "libstarloop_client.so.0"
    places = [here / name, *(here.parents[1] / below / name for below in (".", "lib"))]
    places += sorted(here.parents[1].glob("*/" + name))
    found = os.environ.get("STARLOOP_CLIENT_LIBRARY") or next(
        (str(place) for place in places if place.is_file()), None)
    library = ctypes.CDLL(found or ctypes.util.find_library("starloop_client") or name)
    library.starloop_last_error.restype = ctypes.c_char_p
    for function in ("starloop_close", "starloop_detach"):
        getattr(library, function).restype = None
        getattr(library, function).argtypes = [ctypes.c_void_p]
    return library


_library = _load()
_doubles = {n: ctypes.c_double * n for n in (2, 3, 4)}


def _check(status):
    if status != 0:
        raise _ERRORS.get(status, Error)(_library.starloop_last_error().decode())


class _Mapping:
    """The shared memory: unmapped when neither a camera nor an array looks at it any more."""

    def __init__(self, handle):
        self.handle = handle

    def __del__(self):
        _library.starloop_close(self.handle)


class Frame:
    """A frame where it lies: .sequence, .shutter_open_ns, .exposure_ns, .middle_ns, .bits,
    .pixels[v, u], .telemetry_row or None, .trim_rad, .j2000_to_camera, .rate_rad_s, .skipped,
    .dropped, .late, .commands, .link_lost. A context manager that releases it."""

    def __init__(self, camera, raw):
        self._camera, self._raw, self._held = camera, raw, True
        self.pixels = self._view(raw.pixels, (raw.height_px, raw.width_px))
        self.telemetry_row = (self._view(raw.telemetry_row, (raw.width_px,))
                              if raw.telemetry_row else None)
        self.middle_ns = raw.shutter_open_ns + raw.exposure_ns // 2
        self.trim_rad = tuple(raw.trim_rad)
        self.j2000_to_camera = tuple(raw.j2000_to_camera)
        self.rate_rad_s = tuple(raw.rate_rad_s)

    def _view(self, address, shape):
        buffer = (ctypes.c_uint16 * int(numpy.prod(shape))).from_address(address)
        buffer.mapping = self._camera._mapping  # lives as long as the array does
        view = numpy.frombuffer(buffer, dtype=numpy.uint16).reshape(shape)
        view.flags.writeable = False
        return view

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        return getattr(self._raw, name)

    def check(self):
        """Raises Rejected when the pixels are not those that the camera sent."""
        _check(_library.starloop_check_frame(ctypes.byref(self._raw)))

    def answer(self, centroid_px=(0, 0), confidence=0.0, id=0, box_px=(0, 0, 0, 0),
               time_to_live_s=0.0, more_follow=False):
        """What a command that answers this frame carries: the default is "nothing detected"."""
        detection = Detection((ctypes.c_float * 2)(*centroid_px), confidence, id,
                              (ctypes.c_float * 4)(*box_px))
        return Answer(self.sequence, self.shutter_open_ns + self.exposure_ns,
                      round(time_to_live_s * 1e9), int(more_follow), detection)

    def release(self):
        """Gives the frame back; again is harmless."""
        if self._held:
            self._held = False
            _check(_library.starloop_release_frame(self._camera._handle(),
                                                   ctypes.byref(self._raw)))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self._camera._mapping is not None:
            self.release()


class Camera:
    """One end of a link; a context manager. The only reader at a time."""

    def __init__(self, name, timeout_s=10.0):
        self._mapping = None
        handle = ctypes.c_void_p()
        _check(_library.starloop_open(ctypes.byref(handle), os.fsencode(name),
                                      round(timeout_s * 1000)))
        self._mapping = _Mapping(handle)

    def _handle(self):
        if self._mapping is None:
            raise Disconnected("the camera is closed")
        return self._mapping.handle

    def wait_frame(self, timeout_s):
        """The oldest frame not yet seen. Release it, or use it in a with."""
        raw = _Frame()
        _check(_library.starloop_wait_frame(self._handle(), ctypes.byref(raw),
                                            round(timeout_s * 1000)))
        return Frame(self, raw)

    def frames(self, timeout_s):
        """Frame after frame, each released when the next is asked for, until the camera is gone."""
        while True:
            try:
                frame = self.wait_frame(timeout_s)
            except Disconnected:
                return
            with frame:
                yield frame

    def send_report(self, answer):
        _check(_library.starloop_send_report(self._handle(), _pointer(answer)))

    def send_trim(self, offset_rad, rate_rad_s, reference_ns, answer=None):
        _check(_library.starloop_send_trim(
            self._handle(), _pointer(answer), _doubles[2](*offset_rad), _doubles[2](*rate_rad_s),
            ctypes.c_int64(reference_ns)))

    def send_rate(self, rate_rad_s, reference_ns, answer=None):
        _check(_library.starloop_send_rate(self._handle(), _pointer(answer),
                                           _doubles[2](*rate_rad_s), ctypes.c_int64(reference_ns)))

    def send_attitude(self, j2000_to_camera, rate_rad_s, reference_ns, answer=None):
        _check(_library.starloop_send_attitude(
            self._handle(), _pointer(answer), _doubles[4](*j2000_to_camera),
            _doubles[3](*rate_rad_s), ctypes.c_int64(reference_ns)))

    def send_mode(self, mode, answer=None):
        _check(_library.starloop_send_mode(self._handle(), _pointer(answer), mode))

    def send_ping(self, answer=None):
        _check(_library.starloop_send_ping(self._handle(), _pointer(answer)))

    def close(self):
        """Gives up the link; arrays that are still around keep their memory."""
        if self._mapping is not None:
            _library.starloop_detach(self._mapping.handle)
            self._mapping = None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def _pointer(answer):
    return None if answer is None else ctypes.byref(answer)
