//! The programs that write MTL files, as far as their files mean something of their own.

use crate::options::MtlColors;
use blinn_scene::BlenderVersion;

/// The program that wrote an MTL file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum MtlWriter {
    #[default]
    Unknown,
    /// Blender, with its version if the file names it.
    Blender(Option<BlenderVersion>),
    /// Blender's exporter up to 2.93, which does not write its version into MTL files.
    OldBlender,
    /// VTK, PyVista and ParaView.
    Vtk,
    Jmol,
    MolStar,
    /// MeshLab and PyMeshLab.
    MeshLab,
    /// Open CASCADE, and with it cascadio.
    OpenCascade,
    SweetHome3d,
    LeoCad,
    SolveSpace,
    TopologicPy,
    Trimesh,
    Wings,
}

/// Text in the head of a file that names its program.
const MARKS: [(&str, MtlWriter); 10] = [
    ("written by the visualization toolkit", MtlWriter::Vtk),
    ("Created by Jmol", MtlWriter::Jmol),
    ("by Meshlab", MtlWriter::MeshLab),
    ("by MeshLab", MtlWriter::MeshLab),
    ("Open CASCADE", MtlWriter::OpenCascade),
    ("Sweet Home 3D", MtlWriter::SweetHome3d),
    ("LeoCAD", MtlWriter::LeoCad),
    ("topologicpy", MtlWriter::TopologicPy),
    ("mikedh/trimesh", MtlWriter::Trimesh),
    ("Exported from Wings 3D", MtlWriter::Wings),
];

/// Lines of a file's head.
const HEAD_LINES: usize = 20;

impl MtlWriter {
    /// Finds the program by the first lines of the MTL, or else by the generator of the OBJ.
    pub fn find(mtl: &str, generator: &str) -> MtlWriter {
        let text = mtl.trim_start_matches('\u{feff}').trim_start();
        if text.starts_with("# Blender MTL File") {
            return MtlWriter::OldBlender;
        }
        if text.starts_with("# Blender") {
            return MtlWriter::Blender(text.lines().next().and_then(BlenderVersion::from_generator));
        }
        let lines =
            || text.split(['\n', '\r']).map(str::trim).filter(|line| !line.is_empty()).take(HEAD_LINES);
        let marked =
            |line: &str| MARKS.iter().find(|(mark, _)| line.contains(mark)).map(|&(_, writer)| writer);
        let mut comments = lines().take_while(|line| line.starts_with('#'));
        if let Some(writer) = comments.find_map(marked).or_else(|| marked(generator)) {
            return writer;
        }
        // Mol* names itself in neither file. These constants are those of Jmol.
        let has = |statement: &str| lines().any(|line| line == statement);
        if has("Ns 163") && has("Ni 0.001") {
            return MtlWriter::MolStar;
        }
        let mut statements = lines();
        match (statements.next(), statements.next()) {
            (Some(name), Some(color)) if is_named_by_color(name, color) => MtlWriter::SolveSpace,
            _ => MtlWriter::Unknown,
        }
    }

    /// Returns true for Blender of any version.
    pub fn is_blender(self) -> bool {
        matches!(self, MtlWriter::Blender(_) | MtlWriter::OldBlender)
    }

    /// Returns the version of Blender, if the file names it.
    pub fn blender_version(self) -> Option<BlenderVersion> {
        if let MtlWriter::Blender(version) = self { version } else { None }
    }

    /// Returns true if colours are displayed (sRGB) values. Blender writes linear ones, and so do files of unknown
    /// programs: the lecture's k_d.
    pub fn colors_are_srgb(self, choice: MtlColors) -> bool {
        match choice {
            MtlColors::Auto => {
                !(self.is_blender() || matches!(self, MtlWriter::Unknown | MtlWriter::Trimesh))
            }
            MtlColors::Srgb => true,
            MtlColors::Linear => false,
        }
    }
}

/// Returns true for `newmtl h8040ff` before `Kd 0.502 0.251 1.000`. SolveSpace names itself in neither file, but names its
/// materials by their colours.
fn is_named_by_color(name: &str, color: &str) -> bool {
    let Some(digits) = name.strip_prefix("newmtl h").filter(|digits| digits.len() == 6) else {
        return false;
    };
    let Ok(packed) = u32::from_str_radix(digits, 16) else {
        return false;
    };
    let [_, r, g, b] = packed.to_be_bytes().map(|byte| f32::from(byte) / 255.0);
    color == format!("Kd {r:.3} {g:.3} {b:.3}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn programs_are_found_by_their_heads() {
        for (mtl, generator, expected) in [
            (
                "# Blender 5.0.1 MTL File: 'None'\nnewmtl a",
                "",
                MtlWriter::Blender(Some(BlenderVersion::new(5, 0))),
            ),
            ("# Blender MTL File: 'a.blend'\nnewmtl a", "", MtlWriter::OldBlender),
            ("# Blender\nnewmtl a", "", MtlWriter::Blender(None)),
            ("#\n# Wavefront material file\n# Converted by Meshlab Group\n#\n", "", MtlWriter::MeshLab),
            (
                "\u{feff}\r\n# Created by Jmol 14.32.83\r\n\r\nnewmtl a\n Ns 163\n Ni 0.001\n",
                "",
                MtlWriter::Jmol,
            ),
            ("newmtl 0xff8040\nillum 2\nNs 163\nNi 0.001\n", "", MtlWriter::MolStar),
            ("newmtl a\n", "Model exported from LeoCAD", MtlWriter::LeoCad),
            ("newmtl h8040ff\nKd 0.502 0.251 1.000\n", "", MtlWriter::SolveSpace),
            ("newmtl h8040ff\nKd 0.216 0.051 1.000\n", "", MtlWriter::Unknown),
            ("newmtl h8040ff\n", "", MtlWriter::Unknown),
            ("newmtl hélène\nKd 0.502 0.251 1.000\n", "", MtlWriter::Unknown),
            ("newmtl color_000\n", "topologicpy The version that you are using", MtlWriter::TopologicPy),
            ("# Exported from Wings 3D 2.2.9\r\nnewmtl a\r\n", "", MtlWriter::Wings),
            ("# https://github.com/mikedh/trimesh\n", "", MtlWriter::Trimesh),
            ("newmtl a\n# Created by Jmol\nNs 163\n", "Blender 5.0", MtlWriter::Unknown),
            ("", "", MtlWriter::Unknown),
        ] {
            assert_eq!(MtlWriter::find(mtl, generator), expected, "{mtl}");
        }
    }
}
