//! Files with the structure that exporters write (docs/reference/exporters.md), each with what must be shown of it. Tests of
//! single rules are beside the importers in src/import.
//!
//! - `gltf`: glTF of PyVista, PlayCanvas, loaders.gl, ParaView and FBX2glTF
//! - `obj`: OBJ and MTL of CloudCompare, OpenCTM, LeoCAD, yt, ursina, Sweet Home 3D, PyMOL, Babylon.js and IfcOpenShell

#[path = "../common/mod.rs"]
mod common;

mod gltf;
mod obj;
