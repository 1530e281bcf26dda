//! Parsers of sizes and kinds of rays of benchmarks.

use blinn_bench::BenchStage;
use blinn_session::values::size;

/// `WxH`, or several without duplicates: `480x270,1920x1080`.
pub fn sizes(text: &str) -> Result<Vec<(u32, u32)>, String> {
    if !text.contains(['x', 'X']) {
        return Ok(vec![size(text)?]);
    }
    let mut sizes = Vec::new();
    for part in text.split(',') {
        let size = size(part)?;
        if !sizes.contains(&size) {
            sizes.push(size);
        }
    }
    Ok(sizes)
}

/// The most threads of a benchmark.
const MAX_THREADS: u16 = 1024;

/// Numbers of threads: a list of numbers and ranges, such as `1,2,4-8`, without duplicates.
pub fn thread_counts(text: &str) -> Result<Vec<u16>, String> {
    let number = |text: &str| {
        let number = text.trim().parse::<u16>().ok().filter(|n| (1..=MAX_THREADS).contains(n));
        number.ok_or_else(|| format!("'{text}' is no number of threads from 1 to {MAX_THREADS}"))
    };
    let mut counts = Vec::new();
    for part in text.split(',') {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        let (first, last) = (number(first)?, number(last)?);
        if first > last {
            return Err(format!("'{part}' is no range of numbers of threads, such as 1-4"));
        }
        for count in first..=last {
            if !counts.contains(&count) {
                counts.push(count);
            }
        }
    }
    Ok(counts)
}

/// The name of a kind of rays.
pub fn ray_kind(text: &str) -> Result<BenchStage, String> {
    let mut kinds = BenchStage::ALL.into_iter().filter(|stage| stage.traces_rays());
    kinds.clone().find(|stage| stage.name() == text).ok_or_else(|| {
        let last = kinds.next_back().map_or("", BenchStage::name);
        let names: Vec<&str> = kinds.map(BenchStage::name).collect();
        format!("expected {} or {last}", names.join(", "))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thread_counts_are_numbers_and_ranges() {
        assert_eq!(thread_counts("1,2").unwrap(), [1, 2]);
        assert_eq!(thread_counts("8,1-3,2").unwrap(), [8, 1, 2, 3]);
        for wrong in ["", "1,", "0", "1-0", "3-2", "1-", "1025", "-1", "two"] {
            assert!(thread_counts(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn sizes_are_a_list_without_duplicates() {
        assert_eq!(sizes("480x270,64X32,480x270").unwrap(), [(480, 270), (64, 32)]);
        assert_eq!(sizes("640,360").unwrap(), [(640, 360)]);
        assert_eq!(sizes("1x1,2").unwrap(), [(1, 1), (2, 2)]);
        assert!(sizes("480x270,").is_err() && sizes("").is_err() && sizes("1x1,x").is_err());
    }
}
