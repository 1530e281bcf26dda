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
    fn sizes_are_a_list_without_duplicates() {
        assert_eq!(sizes("480x270,64X32,480x270").unwrap(), [(480, 270), (64, 32)]);
        assert_eq!(sizes("640,360").unwrap(), [(640, 360)]);
        assert!(sizes("480x270,").is_err() && sizes("").is_err() && sizes("1x1,2").is_err());
    }
}
