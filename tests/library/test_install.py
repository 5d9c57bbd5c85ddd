"""What is installed: every header compiles alone as C11 and C++ without extensions, the library exports what the headers
declare and nothing else, it drags in no more than it needs, and its version is one."""
import re
import sys
import tempfile

from installed import ROOT, STRICT, Installed, compilers, run

# Files that people who install the daemon have had all along, and what a library adds.
WANTED = ["bin/splatd", "share/man/man5/splatd.conf.5", "include/splatd/splatd.h"]
FOREIGN = re.compile(r"lib(av|sw|microhttpd|uv|archive|crypto|systemd|openblas|blas|lapack|webpmux)", re.I)
DECLARED = re.compile(r"^SPL_API\b[^;]*?\b(spl_\w+)\(", re.M)


def everything_is_there(lib):
    for name in WANTED:
        assert (lib.prefix / name).exists(), name
    named = set(re.findall(r"<splatd/(\w+\.h)>", (lib.headers / "splatd.h").read_text()))
    assert named | {"splatd.h"} == {path.name for path in lib.headers.iterdir()}, named
    assert "synth.h" not in named


def each_header_compiles_alone(lib):
    tried = set()
    for compiler, language, standard in compilers():
        for header in sorted(lib.headers.iterdir()):
            source = lib.folder / f"alone.{'c' if language == 'c' else 'cc'}"
            source.write_text(f"#include <splatd/{header.name}>\n#include <splatd/{header.name}>\n"
                              "int main(void) { return 0; }\n")
            run(compiler, f"-std={standard}", *STRICT, "-fsyntax-only", *lib.pkg_config("--cflags"), source)
        tried.add(language)
    assert tried == {"c", "c++"}, f"no compiler for {({'c', 'c++'} - tried)}"


def cxx_programs_link(lib):
    source = lib.folder / "plus.cc"
    source.write_text("""#include <splatd/splatd.h>
int main()
{
    spl_renderer_options options;
    spl_renderer_options_init(&options);
    spl_error err = {};
    spl_dataset *dataset = nullptr;
    return options.size == sizeof options && spl_version_number() == SPL_VERSION_NUMBER &&
                   spl_dataset_open("/nonexistent.spld", false, &dataset, &err) == SPL_E_NOT_FOUND && err.message[0]
               ? 0 : 1;
}
""")
    for compiler, language, standard in compilers():
        if language == "c++":
            lib.run(lib.build(source, standard, compiler))


def declared(lib):
    return {name for header in lib.headers.iterdir() for name in DECLARED.findall(header.read_text())}


def it_exports_what_is_declared(lib):
    lines = run("nm", "-D", "--defined-only", lib.library).splitlines()
    exported = {line.split()[-1].split("@")[0] for line in lines} - {"__bss_start", "_edata", "_end"}  # some linkers' own
    names = declared(lib)
    assert len(names) > 40, names
    assert exported == names, f"only exported: {sorted(exported - names)}, only declared: {sorted(names - exported)}"
    undeclared = [line for header in lib.headers.iterdir() for line in header.read_text().splitlines()
                  if re.match(r"(?!SPL_API|static|typedef|#)\w[\w \*]*\bspl_\w+\(", line)]
    assert not undeclared, f"without SPL_API: {undeclared}"


def every_call_is_documented(lib):
    """api/library.md has a table of calls; `_x` stands for the same module's, `…_from_name` for every name of its row."""
    told = set()
    for row in re.findall(r"^\| (`[^|]*) \|", (ROOT / "api/library.md").read_text(), re.M):
        words = re.findall(r"`([^`]+)`", row)
        module = "_".join(words[0].split("_")[:2])
        for word in words:
            told.add(module + word if word.startswith("_") else word)
        if "…_from_name" in words:
            told |= {re.sub("_name$", "_from_name", word) for word in words}
    missing = declared(lib) - told
    assert not missing, f"not in api/library.md: {sorted(missing)}"
    gone = {name for name in told if name.startswith("spl_")} - declared(lib)
    assert not gone, f"in api/library.md, but not there: {sorted(gone)}"


def it_needs_no_more_than_it_uses(lib):
    dynamic = run("readelf", "-d", lib.library)
    assert "soname: [libsplatd.so.0]" in dynamic, dynamic
    assert lib.library.resolve().name == "libsplatd.so." + lib.pkg_config("--modversion")[0]
    foreign = [line for line in run("ldd", lib.library).splitlines() if FOREIGN.search(line)]
    assert not foreign, foreign
    assert "libsplatd" not in run("readelf", "-d", lib.prefix / "bin/splatd"), "the daemon is one file"


def there_is_one_version(lib):
    version = lib.pkg_config("--modversion")[0]
    api = (lib.headers / "api.h").read_text()
    numbers = re.findall(r"#define SPL_VERSION_(?:MAJOR|MINOR|PATCH) (\d+)", api)
    assert ".".join(numbers) == version, (numbers, version)
    assert lib.run(lib.prefix / "bin/splatd", "--version").split()[-1] == version


def main():
    with tempfile.TemporaryDirectory() as folder:
        lib = Installed(folder)
        for check in (everything_is_there, each_header_compiles_alone, cxx_programs_link, it_exports_what_is_declared,
                      every_call_is_documented, it_needs_no_more_than_it_uses, there_is_one_version):
            check(lib)
            print(f"{check.__name__}: ok")


if __name__ == "__main__":
    sys.exit(main())
