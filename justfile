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

# Criterion benches.
bench:
    cargo bench

# Writes a generated scene: `just scene scan 1.1m target/scenes/scan.glb`. Kinds: scan, interior,
# stadium, forest, slivers, soup, layers.
scene kind triangles file *flags:
    cargo run --release -q -p blinn-scenes -- {{kind}} {{triangles}} {{file}} {{flags}}

# blinn's rays, builds and frames beside Embree's: `just bench-peers rays --quick`, and without words
# all of docs/performance.md. `just bench-peers programs` measures whole programs.
bench-peers *words:
    bash benches/peers/run {{words}}
