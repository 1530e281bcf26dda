//! Small files with bytes changed or cut off: no mutant panics, hangs, or needs more than a second or 256
//! MiB.
//!
//! `cargo test` runs a sample of the mutants, with a different offset for each seed; `just fuzz-full` runs
//! all, nearly 800,000. The current mutant is in `target/tmp/mutations/`, and stays there if it ends the
//! process.

mod mutant_runner;
mod seeds;

use mutant_runner::MutantRunner;

use crate::alone;

/// The changes to a byte.
const CHANGES: [fn(&mut Vec<u8>, usize); 10] = [
    |b, i| b[i] ^= 1,
    |b, i| b[i] ^= 0x10,
    |b, i| b[i] ^= 0x80,
    |b, i| b[i] = 0,
    |b, i| b[i] = 0xff,
    |b, i| b[i] = b[i].wrapping_add(1),
    |b, i| b[i] = b'9',
    |b, i| b[i] = b'-',
    |b, i| _ = b.remove(i),
    |b, i| b.insert(i, b[i]),
];

/// Runs every `step`-th mutant of all seeds. Returns how many there were.
fn try_all(step: usize) -> usize {
    let _turn = alone();
    let seeds = seeds::all();
    assert!(seeds.len() >= 40, "{} seeds", seeds.len());
    let mut runner = MutantRunner::new();
    for (i, seed) in seeds.iter().enumerate() {
        let size = seed.bytes().len();
        assert!((1..=4096).contains(&size), "{} has {size} bytes", seed.name);
        assert!(runner.reads(seed, seed.bytes()), "{} itself is not read", seed.name);
        let before = runner.tried();
        // Mutants in order: the changes to each byte, then the cut before it.
        let row = CHANGES.len() + 1;
        for number in (i % step..size * row).step_by(step) {
            let (at, change) = (number / row, number % row);
            let mut mutant = seed.bytes().to_vec();
            match CHANGES.get(change) {
                Some(change) => change(&mut mutant, at),
                None => mutant.truncate(at),
            }
            runner.run(seed, &mutant, format_args!("byte {at}, change {change}"));
        }
        println!("{}: {} mutants, {}", seed.name, runner.tried() - before, runner.worst());
    }
    runner.finish()
}

#[test]
fn a_share_of_the_mutants_does_no_harm() {
    let tried = try_all(67);
    assert!(tried > 10_000, "{tried}");
}

#[test]
#[ignore = "takes several minutes: just fuzz-full"]
fn no_mutant_does_harm() {
    let tried = try_all(1);
    assert!(tried > 700_000, "{tried}");
}
