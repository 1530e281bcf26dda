# The day's commands; `just` lists them.
default:
    @just --list

# All that must pass.
check:
    bash .ci/run

# Rewrite golden images. Look at each that changed before committing it.
golden:
    GOLDEN=update cargo test --test golden

# Judge the listed cases of the reference corpora; `just corpus all` shows what does not pass yet.
corpus which="":
    bash .ci/corpus {{which}}

# The book of docs/, as a site in target/book; needs mdbook.
book:
    mdbook build docs

# docs/reference/command-line.md, from the program's own help.
reference:
    GOLDEN=update cargo test --locked --test help

# The gallery's pictures and its page; needs Python with pillow.
gallery *names:
    cargo build --release --locked
    python3 docs/scripts/gallery.py target/release/blinn {{names}}

# What README and docs tell to type, and their links.
docs *pages:
    cargo build --release --locked
    python3 .ci/docs.py target/release/blinn {{pages}}

# A program that needs no library of the machine it runs on.
static:
    RUSTFLAGS="-C target-feature=+crt-static" cargo build --release --locked --target x86_64-unknown-linux-gnu

# That program with its man pages and completions as a Debian package; needs cargo-deb. DEBFULLNAME and
# DEBEMAIL say who makes it.
deb: static
    bash docs/scripts/packaging.sh target/x86_64-unknown-linux-gnu/release/blinn target/packaging
    cargo deb --no-build --strip --target x86_64-unknown-linux-gnu \
        --maintainer "${DEBFULLNAME:-The blinn developers} <${DEBEMAIL:-blinn@localhost}>"

# Criterion benches.
bench:
    cargo bench

# The standard scenes measured, with a page: `just suite` or `just suite 10k,70k,1.1m --compare old.json`.
suite *words:
    cargo run --release -q -- bench --suite {{words}} --json target/bench.json --report target/bench.html

# Writes a generated scene: `just scene scan 1.1m target/scenes/scan.glb`. Kinds: scan, interior,
# stadium, forest, slivers, soup, layers.
scene kind triangles file *flags:
    cargo run --release -q -p blinn-scenes -- {{kind}} {{triangles}} {{file}} {{flags}}

# blinn's rays, builds and frames beside Embree's: `just bench-peers rays --quick`, and without words
# all of docs/explanation/performance.md. `just bench-peers programs` measures whole programs.
bench-peers *words:
    bash benches/peers/run {{words}}

# Every mutant of every seed: nearly 800,000, in some 16 minutes of one processor.
fuzz-full:
    cargo test --locked --test mutations -- --ignored --nocapture

# The share of them that every test run tries.
fuzz-smoke:
    cargo test --locked --test mutations -- --nocapture

# Looks for inputs that break a target of tests/fuzz (`just fuzz` lists them), for so many seconds; needs
# cargo-fuzz and a nightly compiler. What is new goes to target/fuzzing, a crash to tests/fuzz/artifacts,
# and with its mend to tests/fuzz/corpus.
fuzz target="" seconds="600":
    #!/usr/bin/env bash
    set -euo pipefail
    export CARGO_PROFILE_RELEASE_LTO=off CARGO_PROFILE_RELEASE_CODEGEN_UNITS=16
    if [ -z "{{target}}" ]; then exec cargo fuzz list --fuzz-dir tests/fuzz; fi
    mkdir -p "target/fuzzing/{{target}}"
    cargo +nightly fuzz run --fuzz-dir tests/fuzz --target-dir target/fuzzing --sanitizer none {{target}} \
        "target/fuzzing/{{target}}" "tests/fuzz/corpus/{{target}}" -- \
        -max_total_time={{seconds}} -max_len=4096 -timeout=10 -rss_limit_mb=2048

# What Miri says of rays' arithmetic: the portable tier, the hit test and geometry; needs a nightly compiler
# with the miri component. Slow: some of the tests try millions.
miri *tests="accel::hit accel::simd::tests geometry":
    MIRIFLAGS=-Zmiri-disable-isolation cargo +nightly miri test --locked --lib -- {{tests}} --skip the_judgement_is_exact

# The oldest compiler that Cargo.toml promises; needs it installed.
msrv:
    cargo +1.92 check --locked --all-targets

# The lines of src/import that tests reach; needs cargo-llvm-cov and the llvm-tools component. Where a test
# fills the disk there is no room for its counts.
coverage:
    cargo llvm-cov --locked --summary-only --lib \
        --test escapes --test limits --test light_units --test mutations --test pictures --test pitfalls \
        --test program --test references --test twins \
        --ignore-filename-regex 'src/(accel|batch|bench|cli|display|geometry|integrator|output|render|scene)/|src/(lib|main)\.rs|tests/|benches/' -- --skip a_full_disk

# Licences, bans and sources of what blinn is made of; needs cargo-deny. `just deny advisories` asks the
# database of known defects too, which needs a network.
deny *more:
    cargo deny check bans licenses sources {{more}}

# The same bytes on any number of threads, for any tiles and instructions: 225 pictures of each scene.
determinism:
    cargo test --locked --test determinism -- --ignored --nocapture

# Ten thousand frames in one process.
soak:
    cargo test --locked --release --test soak -- --ignored --nocapture

# Bad files' outcomes, written anew: read what changed.
bad-files:
    GOLDEN=update cargo test --locked --test bad_files
