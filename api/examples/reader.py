"""A dataset that is read through a function of ours, and opening that is cancelled, through libsplatd.so and ctypes alone.

    python3 reader.py courtyard.spld

The bytes lie in a file here; they may as well come out of an archive, from memory or over a network. The declarations
are those of <splatd/dataset.h> and <splatd/cancel.h>."""
import ctypes as c
import errno
import os
import sys

u64, size_t = c.c_uint64, c.c_size_t
CANCELLED = b"cancelled"  # the name of SPL_E_CANCELLED

Read = c.CFUNCTYPE(c.c_int64, c.c_void_p, u64, c.c_void_p, size_t)
Close = c.CFUNCTYPE(None, c.c_void_p)


class Error(c.Structure):  # struct spl_error
    _fields_ = [("code", c.c_int), ("field", c.c_char * 64), ("message", c.c_char * 512)]


class Code(c.Structure):  # struct spl_code_info
    _fields_ = [("name", c.c_char_p), ("retry", c.c_bool)]


class Cancel(c.Structure):  # struct spl_cancel: zeroed, and touched by the library's functions alone
    _fields_ = [("cancelled", c.c_bool)]


class Reader(c.Structure):  # struct spl_reader
    _fields_ = [("size", size_t), ("bytes", u64), ("read", Read), ("close", Close), ("context", c.c_void_p)]


class OpenOptions(c.Structure):  # struct spl_open_options
    _fields_ = [("size", size_t), ("verify", c.c_bool), ("cancel", c.POINTER(Cancel)), ("reader", c.POINTER(Reader))]


class Info(c.Structure):  # struct spl_dataset_info, which is lent: only its beginning is declared here
    _fields_ = [("id", c.c_char * 128), ("version", u64), ("file_bytes", u64), ("page_bytes", u64),
                ("dictionary_bytes", u64), ("points", u64), ("leaf_splats", u64), ("splats", u64)]


LIB = c.CDLL("libsplatd.so.0")
LIB.spl_code_get_info.restype = c.POINTER(Code)
LIB.spl_dataset_get_info.restype = c.POINTER(Info)
LIB.spl_dataset_get_info.argtypes = LIB.spl_dataset_close.argtypes = [c.c_void_p]
LIB.spl_cancel_set.argtypes = LIB.spl_cancel_clear.argtypes = [c.POINTER(Cancel)]
LIB.spl_dataset_open_with.argtypes = [c.c_char_p, c.POINTER(OpenOptions), c.POINTER(c.c_void_p), c.POINTER(Error)]


class Bytes:
    """Where the dataset's bytes come from. It has to live as long as the dataset: ctypes keeps no callback alive."""

    def __init__(self, path):
        self.file = os.open(path, os.O_RDONLY)
        self.read_bytes, self.stop_at, self.cancel = 0, None, Cancel()
        self.reader = Reader(size=c.sizeof(Reader), bytes=os.fstat(self.file).st_size, read=Read(self.read),
                             close=Close(self.close))

    def read(self, _context, offset, out, count):
        """Called by any thread that uses the dataset, by several at once. An exception must not leave it: an errno does."""
        try:
            got = os.pread(self.file, count, offset)
        except OSError as error:
            return -(error.errno or errno.EIO)
        c.memmove(out, got, len(got))
        self.read_bytes += len(got)
        if self.stop_at is not None and self.read_bytes >= self.stop_at:
            LIB.spl_cancel_set(c.byref(self.cancel))  # a button or a signal handler does the same, from any thread
        return len(got)

    def close(self, _context):
        """Called once by spl_dataset_close(); where opening fails, this is still ours to do."""
        os.close(self.file)


def open_dataset(name, bytes_):
    """The dataset, or None where it was cancelled."""
    dataset, error = c.c_void_p(), Error()
    options = OpenOptions(size=c.sizeof(OpenOptions), verify=True, cancel=c.pointer(bytes_.cancel),
                          reader=c.pointer(bytes_.reader))
    code = LIB.spl_dataset_open_with(name.encode(), c.byref(options), c.byref(dataset), c.byref(error))
    if code and LIB.spl_code_get_info(code).contents.name == CANCELLED:
        return None
    if code:
        raise RuntimeError(error.message.decode())
    return dataset


def main(path):
    name = os.path.basename(path)  # in errors; without its extension it is the dataset's id
    try:
        bytes_ = Bytes(path)
        bytes_.stop_at = 1
        if open_dataset(name, bytes_) is None:
            print(f"cancelled after {bytes_.read_bytes} of {bytes_.reader.bytes} bytes")
        bytes_.stop_at = None
        LIB.spl_cancel_clear(c.byref(bytes_.cancel))  # nobody uses it now, so it may be used again
        dataset = open_dataset(name, bytes_)
    except (OSError, RuntimeError) as error:
        sys.exit(f"reader: {error}")
    info = LIB.spl_dataset_get_info(dataset).contents
    print(f"{info.id.decode()}: {info.splats} splats of {info.points} points, through our own reads")
    LIB.spl_dataset_close(dataset)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: reader.py NAME.spld")
    main(sys.argv[1])
