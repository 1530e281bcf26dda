//! The boxes of an MP4 with one video track (ISO/IEC 14496-12 and 14496-15).

use std::io;

use mp4_atom::{
    Avc1, Avcc, Co64, Codec, Colr, Dinf, Dref, Encode, FourCC, Ftyp, Hdlr, Mdhd, Mdia, Minf, Moov, Mvhd,
    Pasp, Stbl, Stco, Stsc, StscEntry, Stsd, Stss, Stsz, StszSamples, Stts, SttsEntry, Tkhd, Trak, Url,
    Visual, Vmhd,
};

use crate::animation::encoder::invalid_input;

/// The video track: format, timing, and the index of its frames.
#[derive(Default)]
pub(super) struct Track {
    pub width: u16,
    pub height: u16,
    /// Ticks per second.
    pub timescale: u32,
    /// Ticks per frame.
    pub frame_ticks: u32,
    pub sequence_parameter_set: Vec<u8>,
    pub picture_parameter_set: Vec<u8>,
    /// Bytes of each frame.
    pub frame_sizes: Vec<u32>,
    /// Numbers of the key frames, from 1.
    pub key_frames: Vec<u32>,
}

/// The `ftyp` and `moov` boxes. The frames begin at byte `offset` of the file.
pub(super) fn movie_header(track: &Track, offset: u64) -> io::Result<Vec<u8>> {
    let frames = u32::try_from(track.frame_sizes.len())
        .map_err(|_| invalid_input("the animation has too many frames for MP4".into()))?;
    let duration = u64::from(frames) * u64::from(track.frame_ticks);
    let moov = Moov {
        mvhd: Mvhd {
            timescale: track.timescale,
            duration,
            rate: 1.into(),
            volume: 1.into(),
            next_track_id: 2,
            ..Default::default()
        },
        trak: vec![track_box(track, frames, duration, offset)?],
        ..Default::default()
    };
    let brands = [b"isom", b"iso2", b"avc1", b"mp41"].map(FourCC::new);
    let ftyp = Ftyp { major_brand: brands[0], minor_version: 512, compatible_brands: brands.into() };
    let mut bytes = Vec::new();
    ftyp.encode(&mut bytes).map_err(io::Error::other)?;
    moov.encode(&mut bytes).map_err(io::Error::other)?;
    Ok(bytes)
}

fn track_box(track: &Track, frames: u32, duration: u64, offset: u64) -> io::Result<Trak> {
    let minf = Minf {
        vmhd: Some(Vmhd::default()),
        dinf: Dinf { dref: Dref { entries: vec![Url::default().into()] } },
        stbl: sample_table(track, frames, offset)?,
        ..Default::default()
    };
    Ok(Trak {
        tkhd: Tkhd {
            track_id: 1,
            duration,
            enabled: true,
            in_movie: true,
            width: track.width.into(),
            height: track.height.into(),
            ..Default::default()
        },
        mdia: Mdia {
            mdhd: Mdhd { timescale: track.timescale, duration, language: "und".into(), ..Default::default() },
            hdlr: Hdlr { handler: FourCC::new(b"vide"), name: "video".into() },
            minf,
        },
        ..Default::default()
    })
}

/// The index of all frames, which form one chunk.
fn sample_table(track: &Track, frames: u32, offset: u64) -> io::Result<Stbl> {
    let chunk = StscEntry { first_chunk: 1, samples_per_chunk: frames, sample_description_index: 1 };
    Ok(Stbl {
        stsd: Stsd { codecs: vec![Codec::from(sample_entry(track)?)] },
        stts: Stts { entries: vec![SttsEntry { sample_count: frames, sample_delta: track.frame_ticks }] },
        stss: Some(Stss { entries: track.key_frames.clone() }),
        stsc: Stsc { entries: vec![chunk] },
        stsz: Stsz { samples: StszSamples::Different { sizes: track.frame_sizes.clone() } },
        stco: u32::try_from(offset).ok().map(|offset| Stco { entries: vec![offset] }),
        co64: u32::try_from(offset).is_err().then(|| Co64 { entries: vec![offset] }),
        ..Default::default()
    })
}

/// The codec: H.264 in BT.709, limited range, square pixels.
fn sample_entry(track: &Track) -> io::Result<Avc1> {
    const BT_709: u16 = 1;
    Ok(Avc1 {
        visual: Visual {
            data_reference_index: 1,
            width: track.width,
            height: track.height,
            ..Default::default()
        },
        avcc: Avcc::new(&track.sequence_parameter_set, &track.picture_parameter_set)
            .map_err(io::Error::other)?,
        btrt: None,
        colr: Some(Colr::Nclx {
            colour_primaries: BT_709,
            transfer_characteristics: BT_709,
            matrix_coefficients: BT_709,
            full_range_flag: false,
        }),
        pasp: Some(Pasp { h_spacing: 1, v_spacing: 1 }),
        taic: None,
        fiel: None,
        spatial: None,
    })
}

/// The header of the `mdat` box around `length` bytes: a length of 32 bits, or 1 and a length of 64 bits.
pub(super) fn media_header(length: u64) -> Vec<u8> {
    match u32::try_from(length + 8) {
        Ok(size) => [&size.to_be_bytes()[..], b"mdat"].concat(),
        Err(_) => [&1u32.to_be_bytes()[..], b"mdat", &(length + 16).to_be_bytes()].concat(),
    }
}
