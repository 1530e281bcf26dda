#!/usr/bin/env python3
"""Counts the instructions of pictures of one sample, and prints a Markdown table: instructions per pixel of each stage.

    instructions.py BLINN [--models figure,textured,still-life] [--size 512x512] [--rounds 5] [--functions 20]
                    [--keep FOLDER]

Runs the program under valgrind's callgrind, on one thread and the SIMD level AVX2, the widest that valgrind has. The own
instructions of a function count for the stage of its module. Functions that many stages share (kernels at a SIMD level, memcpy,
allocation, the standard library) count for their callers, each by what it spent in them. Passes over other pixels than those of
the picture are counted in runs of their own. The CPU time is that of the same command without valgrind, the least of some
rounds. Needs valgrind and c++filt.
"""
import argparse
import collections
import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), ".."))

EYE, TRACING, POINTS, TEXTURES, LOBES, LIGHTS, SHADOW, FILM, TONE, PNG, METER, NEAR, MIPS, START, REST = STAGES = (
    "eye rays", "tracing", "surface points and materials", "textures", "lobes and environment", "lights", "shadow rays",
    "compositing and film", "tone mapping", "PNG", "metering", "near plane", "mip levels", "start, reading, building", "rest")
# Functions that work for whoever calls them.
CALLER = "caller"

# Functions that render further pixels: what happens in them is a stage, apart from mip levels, which are made at the first
# look at a texture. Each is a part of the symbol's name.
PASSES = {METER: "5meter5meter", NEAR: "10near_plane12cuts_picture"}

# The stage of each module or function; the longest prefix that fits counts.
MODULES = {
    "blinn_render::sample_generator": EYE,
    "blinn_render::filter": EYE,
    "blinn_render::integrator::sample": EYE,
    "blinn_render::integrator::frame::Frame::generate_eye_rays": EYE,
    "blinn_scene::camera": EYE,
    "blinn_scene::thin_lens": EYE,

    "blinn_accel::Accel::intersect": TRACING,
    "blinn_render::hit_pixels": TRACING,
    "blinn_render::integrator::first_hit": TRACING,
    "blinn_render::integrator::path_rays": TRACING,

    "blinn_accel::Accel::occluded": SHADOW,
    "blinn_accel::Accel::transmittance": SHADOW,
    "blinn_accel::packet::any_hit": SHADOW,
    "blinn_accel::packet::closest_hit": TRACING,
    "blinn_render::integrator::shadow_rays": SHADOW,
    "blinn_render::integrator::surface::shadow_terminator": SHADOW,

    "blinn_render::integrator::gather": POINTS,
    "blinn_render::integrator::ground_plane": POINTS,
    "blinn_render::integrator::material": POINTS,
    "blinn_render::integrator::shading_batch": POINTS,
    "blinn_render::integrator::surface": POINTS,
    "blinn_scene::material": POINTS,

    "blinn_render::integrator::surface::texel_batch": TEXTURES,
    "blinn_render::integrator::surface::texture_eval": TEXTURES,
    "blinn_scene::texture": TEXTURES,
    "blinn_scene::texture::downsample": MIPS,
    "blinn_scene::texture::byte_quads": MIPS,
    "blinn_scene::texture::first_level": MIPS,
    "blinn_scene::texture::interpolated_light": MIPS,
    "blinn_scene::texture::level_": MIPS,
    "blinn_scene::texture::mips": MIPS,
    "blinn_scene::texture::normal_quads": MIPS,

    "blinn_render::integrator::block_lobes": LOBES,
    "blinn_render::integrator::layer_split": LOBES,
    "blinn_render::integrator::layers": LOBES,
    "blinn_render::integrator::lobe_": LOBES,
    "blinn_render::integrator::material::directional_albedo": LOBES,
    "blinn_render::integrator::material::ggx": LOBES,
    "blinn_render::integrator::material::glass_albedo": LOBES,
    "blinn_render::integrator::material::lobe_": LOBES,
    "blinn_render::integrator::reflection_rays": LOBES,
    "blinn_render::integrator::secondary_rays": LOBES,
    "blinn_scene::environment": LOBES,

    "blinn_render::integrator::blinn_phong": LIGHTS,
    "blinn_render::integrator::direct_light": LIGHTS,
    "blinn_render::integrator::environment_lighting": LIGHTS,
    "blinn_render::integrator::highlight_limits": LIGHTS,
    "blinn_render::integrator::light_": LIGHTS,
    "blinn_render::integrator::microfacet_highlights": LIGHTS,
    "blinn_render::integrator::phong": LIGHTS,
    "blinn_render::integrator::surface::highlights": LIGHTS,
    "blinn_scene::light": LIGHTS,

    "blinn_render::film": FILM,
    "blinn_render::integrator::compositor": FILM,
    "blinn_render::integrator::frame::Frame::background_radiance": FILM,
    "blinn_render::integrator::paths": FILM,
    "blinn_render::memory": FILM,
    "blinn_render::strips": FILM,
    "blinn_render::tiles": FILM,

    "blinn_render::display": TONE,

    "blinn_output": PNG,
    "fdeflate": PNG,
    "fdeflate::decompress": START,

    "blinn_accel::build": START,
    "blinn_accel::bvh": START,
    "blinn_cli": START,
    "blinn_import": START,
    "blinn_scene": START,
    "blinn_session": START,
    "clap_builder": START,
    "gltf": START,
    "obvhs": START,
    "png": START,
    "rdst": START,
    "serde": START,
    "zune_jpeg": START,
    "_dl_": START,
    "do_lookup_x": START,

    "blinn_accel": CALLER,
    "blinn_core": CALLER,
    "alloc": CALLER,
    "core": CALLER,
    "glam": CALLER,
    "hashbrown": CALLER,
    "indexmap": CALLER,
    "libm": CALLER,
    "rayon": CALLER,
    "rayon_core": CALLER,
    "simd_adler32": CALLER,
    "std": CALLER,
    "twox_hash": CALLER,
    "__rust": CALLER,
    "__mem": CALLER,
    "_int_": CALLER,
    "calloc": CALLER,
    "free": CALLER,
    "malloc": CALLER,
    "realloc": CALLER,
    "unlink_chunk": CALLER,
}
# Kernels at a SIMD level are functions of one name. Those that call these functions are of the given stage, not of that of their
# callers.
KERNELS = {"blinn_scene::texture::mips::MipMaps::levels": TEXTURES}
PREFIXES = sorted(MODULES, key=len, reverse=True)

# Any value keeps the program from running itself again for the sake of malloc, which hides it from valgrind.
ENVIRONMENT = {**os.environ, "BLINN_SIMD": "avx2", "GLIBC_TUNABLES": "glibc.malloc.hugetlb=0"}


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("blinn", help="the program, not stripped")
    parser.add_argument("--models", default="figure,textured,still-life", metavar="NAMES", help="folders of models/")
    parser.add_argument("--size", default="512x512")
    parser.add_argument("--rounds", type=int, default=5, help="runs whose CPU time is measured")
    parser.add_argument("--functions", type=int, default=0, metavar="N", help="also list N functions of each stage")
    parser.add_argument("--keep", metavar="FOLDER", help="keep callgrind's files there, and read those that are there already")
    return parser.parse_args()


def module(name):
    """The path that a demangled name starts with: of `<&mut a::B<C> as d::E>::f`, a::B<C> as d::E>::f."""
    return re.sub(r"^(<|&|mut |\*const |\*mut |dyn |impl )+", "", name)


def stage(name):
    """The stage of a function, CALLER or REST."""
    path = module(name)
    return next((MODULES[prefix] for prefix in PREFIXES if path.startswith(prefix)), REST)


class Profile:
    """Instructions of functions, and of their calls: what each caller spent in each function."""

    def __init__(self, path):
        self.own = collections.Counter()
        self.callers = collections.defaultdict(collections.Counter)
        names, function, callee = {}, None, None
        with open(path, encoding="utf-8") as lines:
            for line in lines:
                # Names are written once, `fn=(7) name`, and numbers later.
                found = re.match(r"(c?fn)=\((\d+)\)(?: (.*))?$", line)
                if found:
                    kind, number, name = found.groups()
                    if name:
                        names[number] = name
                    if kind == "fn":
                        function = names[number]
                    else:
                        callee = names[number]
                elif re.match(r"[0-9+*-]", line):
                    cost = int((line.split() + ["0"])[1])
                    if callee is None:
                        self.own[function] += cost
                    else:
                        # The line after `calls=` has what the call and all calls in it took.
                        self.callers[callee][function] += cost
                        callee = None

    def stages(self, names):
        """Shares of each function's own instructions among the stages, by its demangled name.

        Those of shared functions are the shares of their callers; some call themselves, so they are repeated until they settle.
        """
        fixed = {function: stage(names[function]) for function in names}
        for callee, callers in self.callers.items():
            for kernel in callers if names[callee] in KERNELS else ():
                if fixed[kernel] == CALLER:
                    fixed[kernel] = KERNELS[names[callee]]
        shares = {function: {} if found == CALLER else {found: 1.0} for function, found in fixed.items()}
        shared = [function for function, found in fixed.items() if found == CALLER]
        for _ in range(60):
            for function in shared:
                callers = {caller: cost for caller, cost in self.callers[function].items() if caller != function and cost > 0}
                total = sum(callers.values())
                sums = collections.Counter()
                for caller, cost in callers.items():
                    for found, share in shares[caller].items():
                        sums[found] += share * cost / total if total else 0.0
                shares[function] = sums
        return shares


def demangle(names):
    """Readable names, without hashes."""
    done = subprocess.run(["c++filt"], input="\n".join(names), capture_output=True, text=True, check=True)
    plain = [re.sub(r"\[[0-9a-f]{8,}\]|::h[0-9a-f]{16}\b", "", name) for name in done.stdout.split("\n")]
    return dict(zip(names, plain))


def command(args, model, picture):
    scene = os.path.join(ROOT, "models", model, model + ".glb")
    return [args.blinn, "render", scene, "-o", picture, "--size", args.size, "--samples", "1", "--threads", "1", "--quiet"]


def run(words):
    done = subprocess.run(words, capture_output=True, text=True, env=ENVIRONMENT)
    if done.returncode != 0:
        sys.exit(f"{' '.join(words)}: exit code {done.returncode}\n{done.stderr}")


def cpu_seconds(words):
    """User and system time of a command."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    run(words)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def callgrind(args, model, folder, part):
    """The profile of a model: of the whole program, or of a pass alone."""
    name = model if part is None else f"{model}.{part.replace(' ', '-')}"
    file = os.path.join(folder, name + ".callgrind")
    if not os.path.exists(file):
        print(f"counting {name}", file=sys.stderr)
        only = [] if part is None else [f"--toggle-collect=*{PASSES[part]}*"]
        # Valgrind writes the file of a program that fails, too.
        run(["valgrind", "--tool=callgrind", "--demangle=no", *only, f"--callgrind-out-file={file}.part",
             *command(args, model, os.path.join(folder, name + ".png"))])
        os.replace(file + ".part", file)
    return Profile(file)


def count(args, model, folder):
    """Instructions of each stage, and for each stage those of its functions."""
    profile = callgrind(args, model, folder, None)
    callers = {caller for called in profile.callers.values() for caller in called}
    names = demangle(sorted(set(profile.own) | profile.callers.keys() | callers))
    stages = {found: collections.Counter() for found in STAGES}
    for found in PASSES:
        part = callgrind(args, model, folder, found)
        profile.own.subtract(part.own)
        for function, shares in part.stages(names).items():
            made = shares.get(MIPS, 0.0)
            stages[MIPS][names[function]] += made * part.own[function]
            stages[found][names[function]] += (1.0 - made) * part.own[function]
        for function, called in part.callers.items():
            profile.callers[function].subtract(called)
    for function, shares in profile.stages(names).items():
        left = 1.0 - sum(shares.values())
        for found, share in [*shares.items(), (REST, max(left, 0.0))]:
            stages[found][names[function]] += share * profile.own[function]
    return stages


def table(counts, times, args):
    """A Markdown table: instructions per pixel, and shares of all."""
    width, height = map(int, args.size.split("x"))
    pixels = width * height
    models = list(counts)
    sums = {model: {found: sum(stages[found].values()) for found in STAGES} for model, stages in counts.items()}
    totals = {model: sum(found.values()) for model, found in sums.items()}
    lines = ["| stage | " + " | ".join(models) + " |", "|---|" + "---:|" * len(models)]
    for found in STAGES:
        cells = [f"{sums[m][found] / pixels:,.0f} ({100 * sums[m][found] / totals[m]:.0f} %)" for m in models]
        lines.append(f"| {found} | " + " | ".join(cells) + " |")
    lines.append("| **all instructions** | " + " | ".join(f"**{totals[m] / pixels:,.0f}**" for m in models) + " |")
    if times:
        cells = [f"{1e9 * times[m] / pixels:.0f} ns" for m in models]
        lines.append("| CPU time of the program | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main():
    args = arguments()
    for tool in ("valgrind", "c++filt"):
        if shutil.which(tool) is None:
            sys.exit(f"{tool} is not installed: apt install valgrind binutils")
    if not re.fullmatch(r"[1-9]\d*x[1-9]\d*", args.size):
        sys.exit(f"--size {args.size}: give pixels as WIDTHxHEIGHT")
    models = args.models.split(",")
    with tempfile.TemporaryDirectory() as temporary:
        folder = args.keep or temporary
        os.makedirs(folder, exist_ok=True)
        counts = {model: count(args, model, folder) for model in models}
        times = {}
        for _ in range(args.rounds):
            for model in models:
                seconds = cpu_seconds(command(args, model, os.path.join(folder, model + ".png")))
                times[model] = min(seconds, times.get(model, seconds))
    print(table(counts, times, args))
    for model, stages in counts.items():
        for found in STAGES:
            # What no stage claims is always listed, so that the modules above can be completed.
            most = (+stages[found]).most_common(max(args.functions, 12 if found == REST else 0))
            if most:
                print(f"\n{model}, {found}:")
            for name, instructions in most:
                print(f"  {instructions / 1e6:8.2f} million  {name[:120]}")


if __name__ == "__main__":
    main()
