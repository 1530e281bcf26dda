//! Small files bent byte by byte and cut off anywhere: whatever becomes of them, nothing panics,
//! nothing hangs, and no mutant takes more than a second or 256 MiB.
//!
//! `cargo test` tries a share of the mutants that differs in place from seed to seed;
//! `just fuzz-full` tries all of them, nearly 800,000. All run in this one process. The mutant at hand lies in
//! `target/tmp/mutations/`, and stays there where one ends the process.

mod mutant_runner;
mod seeds;

use mutant_runner::MutantRunner;

use crate::alone;

/// What becomes of the byte at a place, each in its own way.
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

/// Tries every `step`-th mutant of all seeds and returns how many there were.
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
        // Mutants in one row: each byte's changes, then the cut before it.
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
    runner.verdict()
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
