"""A view of a dataset as a numpy array, and what lies in its middle, through libsplatd.so and ctypes alone.

    python3 view.py courtyard.spld view.ppm

Without numpy the pixels are a ctypes array. The declarations below are those of <splatd/*.h>, as far as they are used:
the library reads of a struct what its `size` says, so what a later version adds at the end need not be written here."""
import ctypes as c
import sys

try:
    import numpy
except ImportError:
    numpy = None

u32, u64, real = c.c_uint32, c.c_uint64, c.c_double
COLOR, DEPTH = 0, 1  # enum spl_layer
RGBA8, F32 = 0, 1  # enum spl_pixel_type


class Error(c.Structure):  # struct spl_error
    _fields_ = [("code", c.c_int), ("field", c.c_char * 64), ("message", c.c_char * 512)]


class Distortion(c.Structure):  # struct spl_distortion
    _fields_ = [("kind", c.c_int), ("k", real * 6), ("p", real * 2), ("reach", real)]


class Camera(c.Structure):  # struct spl_camera
    _fields_ = [("eye", real * 3), ("rotation", real * 9), ("fx", real), ("fy", real), ("cx", real), ("cy", real),
                ("width", u32), ("height", u32), ("near", real), ("far", real), ("projection", c.c_int),
                ("lens", Distortion)]


class View(c.Structure):  # struct spl_view, up to what is set here
    _fields_ = [("size", c.c_size_t), ("camera", Camera), ("method", c.c_int), ("layers", u32), ("lod", real),
                ("supersample", real), ("background", c.c_uint8 * 4)]


class Image(c.Structure):  # struct spl_image
    _fields_ = [("layer", c.c_int), ("type", c.c_int), ("width", u32), ("height", u32), ("pixels", c.c_void_p),
                ("row_bytes", c.c_size_t)]


class RendererOptions(c.Structure):  # struct spl_renderer_options
    _fields_ = [("size", c.c_size_t), ("device", c.c_char_p), ("require_gpu", c.c_bool)]


class RenderOptions(c.Structure):  # struct spl_render_options
    _fields_ = [("size", c.c_size_t), ("images", c.POINTER(Image)), ("image_count", c.c_size_t)]


class PickPlane(c.Structure):  # struct spl_pick_plane
    _fields_ = [("point", real * 3), ("normal", real * 3), ("error_mean", real), ("error_most", real), ("points", u64)]


class Pick(c.Structure):  # struct spl_pick
    _fields_ = [("hit", c.c_bool), ("position", real * 3), ("depth", real), ("distance", real), ("normal", real * 3),
                ("color", c.c_uint8 * 4), ("classification", c.c_int32), ("splat", c.c_int64),
                ("primitive", c.c_int), ("plane", PickPlane)]


class Info(c.Structure):  # struct spl_dataset_info, which is lent: only its beginning is declared here
    _fields_ = [("id", c.c_char * 128), ("version", u64), ("file_bytes", u64), ("page_bytes", u64),
                ("dictionary_bytes", u64), ("points", u64), ("leaf_splats", u64), ("splats", u64)]


class Device(c.Structure):  # the beginning of struct spl_device_info
    _fields_ = [("backend", c.c_char * 16), ("index", u32), ("name", c.c_char * 256)]


def load():
    """The library, whose number after .so changes when what is declared above does."""
    lib = c.CDLL("libsplatd.so.0")
    lib.spl_version.restype = c.c_char_p
    lib.spl_dataset_get_info.restype = c.POINTER(Info)
    lib.spl_renderer_get_device.restype = c.POINTER(Device)
    # Pointers are passed as such; without this ctypes would cut them to 32 bits.
    for name, arguments in {
        "spl_dataset_open": [c.c_char_p, c.c_bool, c.POINTER(c.c_void_p), c.POINTER(Error)],
        "spl_dataset_close": [c.c_void_p],
        "spl_dataset_get_info": [c.c_void_p],
        "spl_dataset_get_default_camera": [c.c_void_p, u32, u32, c.POINTER(Camera), c.POINTER(Error)],
        "spl_renderer_create": [c.POINTER(RendererOptions), c.POINTER(c.c_void_p), c.POINTER(Error)],
        "spl_renderer_destroy": [c.c_void_p],
        "spl_renderer_get_device": [c.c_void_p],
        "spl_renderer_add": [c.c_void_p, c.c_void_p, c.POINTER(Error)],
        "spl_renderer_render_with": [c.c_void_p, c.c_void_p, c.POINTER(View), c.POINTER(RenderOptions), c.c_void_p,
                                     c.POINTER(Error)],
        "spl_renderer_pick": [c.c_void_p, c.c_void_p, c.POINTER(View), real, real, c.POINTER(Pick), c.POINTER(Error)],
        "spl_view_init_sized": [c.POINTER(View), c.c_size_t],
    }.items():
        getattr(lib, name).argtypes = arguments
    return lib


LIB = load()


def call(name, *arguments):
    """Calls what fills a struct spl_error as its last argument, and raises what it says."""
    error = Error()
    if getattr(LIB, name)(*arguments, c.byref(error)):
        raise RuntimeError(error.message.decode())


def sized(kind, **members):
    """A struct of options: its size first, zero is the default of all else."""
    return kind(size=c.sizeof(kind), **members)


def make_image(layer, width, height):
    """(pixels, the image that lends them to the library): ours, so nothing of them is freed by it."""
    channels, kind, code = (4, "u1", c.c_uint8) if layer == COLOR else (1, "<f4", c.c_float)
    image = Image(layer=layer, type=RGBA8 if layer == COLOR else F32, width=width, height=height)
    if numpy:
        pixels = numpy.empty((height, width, channels), kind)
        image.pixels, image.row_bytes = pixels.ctypes.data, pixels.strides[0]
    else:
        pixels = (code * (width * height * channels))()
        image.pixels = c.addressof(pixels)  # row_bytes 0: rows are packed
    return pixels, image


def write_ppm(path, pixels, width, height):
    if numpy:
        rgb = pixels[:, :, :3].tobytes()
    else:
        rgb = bytearray(3 * width * height)
        for channel in range(3):
            rgb[channel::3] = bytes(pixels[channel::4])
    with open(path, "wb") as file:
        file.write(f"P6\n{width} {height}\n255\n".encode() + rgb)


def show(dataset, renderer, out):
    view = View()
    LIB.spl_view_init_sized(c.byref(view), c.sizeof(view))  # a view has defaults that are not zero
    view.layers = 1 << COLOR | 1 << DEPTH
    call("spl_dataset_get_default_camera", dataset, 640, 360, c.byref(view.camera))
    width, height = view.camera.width, view.camera.height
    color, color_image = make_image(COLOR, width, height)
    depth, depth_image = make_image(DEPTH, width, height)
    images = (Image * 2)(color_image, depth_image)
    # Both layers have an image, so no frame of the library's is wanted (None).
    call("spl_renderer_render_with", renderer, dataset, c.byref(view),
         c.byref(sized(RenderOptions, images=images, image_count=2)), None)
    write_ppm(out, color, width, height)
    flat = depth.ravel() if numpy else depth
    print(f"{sum(z == z for z in flat)} of {width * height} pixels show something")  # nothing is NaN

    pick = Pick()
    call("spl_renderer_pick", renderer, dataset, c.byref(view), width / 2, height / 2, c.byref(pick))
    if pick.hit:
        x, y, z = pick.position
        print(f"middle: {x:.3f} {y:.3f} {z:.3f}, {pick.distance:.3f} away, splat {pick.splat}")
    else:
        print("middle: nothing")


def main(path, out):
    dataset, renderer = c.c_void_p(), c.c_void_p()  # what was never made is NULL, which every close takes
    try:
        call("spl_dataset_open", path.encode(), True, c.byref(dataset))
        info = LIB.spl_dataset_get_info(dataset).contents  # lent until the dataset is closed
        print(f"{info.id.decode()}: {info.splats} splats of {info.points} points")
        call("spl_renderer_create", c.byref(sized(RendererOptions)), c.byref(renderer))
        call("spl_renderer_add", renderer, dataset)
        print("drawn by", LIB.spl_renderer_get_device(renderer).contents.name.decode())
        show(dataset, renderer, out)
    except RuntimeError as error:
        sys.exit(f"view: {error}")
    finally:
        LIB.spl_renderer_destroy(renderer)  # before the datasets that it draws
        LIB.spl_dataset_close(dataset)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("usage: view.py NAME.spld OUT.ppm")
    main(sys.argv[1], sys.argv[2])
