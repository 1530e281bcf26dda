# Common commands; `just` lists them.
default:
    @just --list

# Run all checks.
check:
    bash .ci/run

# Rewrite golden images. Check each changed image before committing it.
golden:
    GOLDEN=update cargo test --test render golden::

# Run the listed cases of the reference corpora; `just corpus all` runs all.
corpus which="":
    bash .ci/corpus {{which}}

# Build the book of docs/ in target/book; needs mdbook.
book:
    mdbook build docs

# Write docs/reference/command-line.md from the program's own help.
reference:
    GOLDEN=update cargo test --locked --test cli help::

# Wrap the paragraphs of README, docs and the other pages at 120 columns; `just wrap --check` only names those that would change.
wrap *words:
    python3 docs/scripts/wrap.py {{words}}

# Render the gallery's pictures and write its page; needs Python with pillow.
gallery *names:
    cargo build --release --locked
    python3 docs/scripts/gallery.py target/release/blinn {{names}}

# Run the commands of README and docs, and check their links.
docs *pages:
    cargo build --release --locked
    python3 .ci/docs.py target/release/blinn {{pages}}

# Build a static program.
static:
    RUSTFLAGS="-C target-feature=+crt-static" cargo build --profile dist --locked --target x86_64-unknown-linux-gnu

# Build a Debian package of the static program with man pages and completions; needs cargo-deb. DEBFULLNAME
# and DEBEMAIL name the maintainer.
deb: static
    bash docs/scripts/packaging.sh target/x86_64-unknown-linux-gnu/dist/blinn target/packaging
    cargo deb --no-build --strip --profile dist --target x86_64-unknown-linux-gnu \
        --maintainer "${DEBFULLNAME:-The blinn developers} <${DEBEMAIL:-blinn@localhost}>"

# Build a Python wheel in target/wheels, for any x86-64 Linux with glibc 2.28; needs maturin and ziglang from pip.
wheel:
    maturin build --release --locked --zig --compatibility manylinux_2_28 --out target/wheels

# Build the Python module into src/python/blinn for development; needs maturin in a virtual environment.
develop:
    maturin develop --locked

# Run the tests of the installed Python package.
pytest *words:
    python3 -m pytest tests/python {{words}}

# Run the criterion benchmarks.
bench:
    cargo bench

# Measure the standard scenes and write a report: `just suite` or `just suite 10k,70k,1.1m --compare old.json`.
suite *words:
    BLINN_COMMIT=$(git diff --quiet HEAD && git rev-parse HEAD) cargo run --release -q -- bench --suite {{words}} --json target/bench.json --report target/bench.html

# Write a generated scene: `just scene scan 1.1m target/scenes/scan.glb`. Kinds: scan, interior,
# stadium, forest, slivers, soup, layers.
scene kind triangles file *flags:
    cargo run --release -q -p blinn-scenes -- {{kind}} {{triangles}} {{file}} {{flags}}

# Compare rays, builds and frames with Embree: `just bench-peers rays --quick`; without arguments, all tables
# of docs/reference/performance-figures.md. `just bench-peers programs` measures whole programs,
# `just bench-peers objects 2000` many small files.
bench-peers *words:
    bash benches/peers/run {{words}}

# Measure whole frames at each SIMD level of this processor, and print their ratios: `just simd-levels --suite 1.1m --threads 2`.
simd-levels *words:
    cargo build --release --locked
    python3 benches/simd_levels.py target/release/blinn {{words}}

# Count the instructions of pictures of one sample, stage by stage: `just instructions --models figure,tower --functions 20`.
# Needs valgrind.
instructions *words:
    cargo build --release --locked
    python3 benches/instructions.py target/release/blinn {{words}}

# Trace a batch of thumbnails, a large OBJ file and an EXR with layers, and draw docs/images/trace-*.svg.
traces *words:
    cargo build --release --locked
    cargo run --release -q -p blinn-scenes -- scan 1.1m target/scenes/scan.obj
    python3 benches/traces.py target/release/blinn target/scenes/scan.obj {{words}}

# Import every mutant of every seed: nearly 800,000, in some 16 CPU minutes.
fuzz-full:
    cargo test --locked --test allocation mutations:: -- --ignored --nocapture

# Import the mutants that every test run tries.
fuzz-smoke:
    cargo test --locked --test allocation mutations:: -- --nocapture

# Fuzz a target of tests/fuzz (`just fuzz` lists them) for some seconds; needs cargo-fuzz and a nightly
# compiler. New inputs go to target/fuzzing, a crash to tests/fuzz/artifacts; move it to tests/fuzz/corpus with
# the fix.
fuzz target="" seconds="600":
    #!/usr/bin/env bash
    set -euo pipefail
    export CARGO_PROFILE_RELEASE_LTO=off CARGO_PROFILE_RELEASE_CODEGEN_UNITS=16
    if [ -z "{{target}}" ]; then exec cargo fuzz list --fuzz-dir tests/fuzz; fi
    mkdir -p "target/fuzzing/{{target}}"
    cargo +nightly fuzz run --fuzz-dir tests/fuzz --target-dir target/fuzzing --sanitizer none {{target}} \
        "target/fuzzing/{{target}}" "tests/fuzz/corpus/{{target}}" -- \
        -max_total_time={{seconds}} -max_len=4096 -timeout=10 -rss_limit_mb=2048

# Run Miri on the portable SIMD level, the hit test and geometry; needs a nightly compiler with the miri
# component. Slow: some tests trace millions of rays.
miri *tests="simd:: geometry:: traverse::":
    MIRIFLAGS=-Zmiri-disable-isolation cargo +nightly miri test --locked --lib -p blinn-core -p blinn-accel -- {{tests}}

# Check with the minimum supported Rust version; needs it installed.
msrv:
    cargo +1.92 check --locked --all-targets

# Measure the test coverage of src/import; needs cargo-llvm-cov and the llvm-tools component. Skips the test of
# a full disk, which leaves no room for its profile.
coverage:
    cargo llvm-cov --locked --summary-only -p blinn -p blinn-import \
        --test import --test robustness --test allocation --test cli \
        --ignore-filename-regex 'src/(accel|bench|cli|core|output|render|scene|session)/|src/(lib|main)\.rs|tests/|benches/' -- --skip a_full_disk --skip examples::

# Check licences, bans and sources of dependencies; needs cargo-deny. `just deny advisories` also checks the
# advisory database, which needs a network.
deny *more:
    cargo deny check bans licenses sources {{more}}

# Check for the same bytes with any threads, tiles and SIMD level: 225 pictures of each scene.
determinism:
    cargo test --locked --test render determinism:: -- --ignored --nocapture

# Render ten thousand frames in one process.
soak:
    cargo test --locked --release --test allocation soak:: -- --ignored --nocapture

# Render 500 scenes, a fifth of them broken, slow or large, on 1, 2, 7 and 64 threads and with kills, and compare images,
# ledgers and messages.
stress scenes="500":
    cargo build --release --locked
    python3 benches/stress.py target/release/blinn {{scenes}}

# Rewrite the expected results of bad files. Check what changed.
bad-files:
    GOLDEN=update cargo test --locked --test robustness bad_files::

# Build the Blender extension with the wheel of `just wheel`: target/blender/blinn-VERSION-PLATFORM.zip, for Edit >
# Preferences > Get Extensions > Install from Disk. Without a wheel it has no render engine.
blender:
    #!/usr/bin/env bash
    set -euo pipefail
    version=$(sed -n 's/^version = "\(.*\)"/\1/p' src/blender/blender_manifest.toml)
    stage=$(mktemp -d)
    trap 'rm -r "$stage"' EXIT
    cp src/blender/blender_manifest.toml src/blender/*.py LICENSE-MIT LICENSE-APACHE "$stage"
    name=blinn-$version
    wheel=$(ls -t target/wheels/blinn-"$version"-*.whl 2>/dev/null | head -n 1 || true)
    if [ -n "$wheel" ]; then
        case $wheel in
            *linux*x86_64.whl) platform=linux-x64 ;;
            *linux*aarch64.whl) platform=linux-arm64 ;;
            *win_amd64.whl) platform=windows-x64 ;;
            *macosx*arm64.whl) platform=macos-arm64 ;;
            *) platform=macos-x64 ;;
        esac
        mkdir "$stage/wheels"
        cp "$wheel" "$stage/wheels"
        printf 'platforms = ["%s"]\nwheels = ["./wheels/%s"]\n' $platform "$(basename "$wheel")" >>"$stage/blender_manifest.toml"
        name+=-$platform
    else
        echo "no wheel of blinn $version in target/wheels: the extension has no render engine; run just wheel first" >&2
    fi
    mkdir -p target/blender
    zip=$PWD/target/blender/$name.zip
    rm -f "$zip"
    (cd "$stage" && python3 -m zipfile -c "$zip" *)
    echo "$zip"

# Test the Blender extension with a Python that has bpy and pytest: `just blender-test .venv/bin/python`.
blender-test python="python3" *words:
    {{python}} -m pytest tests/blender {{words}}
