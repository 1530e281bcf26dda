//! Bindings to Embree 4's C API. The shared library is loaded at run time, so that Embree is not needed to compile.
#![allow(dead_code, reason = "the layout of structures is Embree's")]

use std::ffi::{CString, c_char, c_int, c_uint, c_void};
use std::mem::ManuallyDrop;
use std::path::{Path, PathBuf};
use std::ptr::null_mut;
use std::sync::atomic::{AtomicIsize, Ordering};
use std::time::Instant;

use blinn_scenes::{GeneratedInstance, GeneratedMesh, GeneratedScene};
use libloading::Library;

type Handle = *mut c_void;

/// `RTCIntersectArguments` and `RTCOccludedArguments`.
#[repr(C)]
pub struct QueryArguments {
    flags: c_uint,
    features: c_uint,
    context: Handle,
    filter: Handle,
    function: Handle,
    rest: [u64; 2],
}

impl QueryArguments {
    pub fn new(coherent: bool) -> QueryArguments {
        let flags = if coherent { 1 << 16 } else { 0 };
        QueryArguments {
            flags,
            features: !0,
            context: null_mut(),
            filter: null_mut(),
            function: null_mut(),
            rest: [0; 2],
        }
    }
}

/// `RTCRay`.
#[repr(C, align(16))]
#[derive(Clone, Copy)]
pub struct Ray {
    pub o: [f32; 3],
    pub near: f32,
    pub d: [f32; 3],
    pub time: f32,
    pub far: f32,
    pub mask: u32,
    pub id: u32,
    pub flags: u32,
}

/// `RTCRayHit`.
#[repr(C, align(16))]
#[derive(Clone, Copy)]
pub struct RayHit {
    pub ray: Ray,
    pub normal: [f32; 3],
    pub uv: [f32; 2],
    pub primitive: u32,
    pub geometry: u32,
    pub instance: [u32; 2],
    pub rest: [u32; 7],
}

/// `RTCRayHitN`, which begins with an `RTCRayN`: SoA, a row for each field.
#[repr(C, align(64))]
#[derive(Clone, Copy)]
pub struct Packet<const N: usize> {
    /// Origin, near, direction, time, far.
    pub numbers: [[f32; N]; 9],
    pub mask: [u32; N],
    pub id: [u32; N],
    pub flags: [u32; N],
    pub normal_uv: [[f32; N]; 5],
    pub primitive: [u32; N],
    pub geometry: [u32; N],
    pub instance: [[u32; N]; 2],
}

/// Row of [`Packet::numbers`].
pub const NEAR: usize = 3;
/// Row of [`Packet::numbers`].
pub const FAR: usize = 8;

type PacketFunction<const N: usize> =
    unsafe extern "C" fn(*const c_int, Handle, *mut Packet<N>, *const QueryArguments);
type MemoryMonitor = extern "C" fn(Handle, isize, bool) -> bool;

macro_rules! api {
    ($($field:ident = $name:ident: fn($($arg:ty),*) $(-> $out:ty)?;)*) => {
        /// The functions. The library is never closed, because TBB's threads outlive every device and would execute
        /// unloaded code.
        pub struct Embree {
            $(pub $field: unsafe extern "C" fn($($arg),*) $(-> $out)?,)*
            _libraries: ManuallyDrop<(Library, Option<Library>)>,
        }

        impl Embree {
            fn bind(library: Library, needed: Option<Library>) -> Result<Embree, libloading::Error> {
                // SAFETY: the types are those of Embree 4's headers; the library lives as long as the
                // pointers.
                unsafe {
                    Ok(Embree {
                        $($field: *library.get(concat!(stringify!($name), "\0").as_bytes())?,)*
                        _libraries: ManuallyDrop::new((library, needed)),
                    })
                }
            }
        }
    };
}

api! {
    new_device = rtcNewDevice: fn(*const c_char) -> Handle;
    release_device = rtcReleaseDevice: fn(Handle);
    device_error = rtcGetDeviceError: fn(Handle) -> c_int;
    monitor = rtcSetDeviceMemoryMonitorFunction: fn(Handle, MemoryMonitor, Handle);
    new_scene = rtcNewScene: fn(Handle) -> Handle;
    release_scene = rtcReleaseScene: fn(Handle);
    quality = rtcSetSceneBuildQuality: fn(Handle, c_int);
    scene_flags = rtcSetSceneFlags: fn(Handle, c_int);
    commit_scene = rtcCommitScene: fn(Handle);
    new_geometry = rtcNewGeometry: fn(Handle, c_int) -> Handle;
    new_buffer = rtcSetNewGeometryBuffer: fn(Handle, c_int, c_uint, c_int, usize, usize) -> *mut c_void;
    instanced = rtcSetGeometryInstancedScene: fn(Handle, Handle);
    transform = rtcSetGeometryTransform: fn(Handle, c_uint, c_int, *const c_void);
    commit_geometry = rtcCommitGeometry: fn(Handle);
    attach = rtcAttachGeometry: fn(Handle, Handle) -> c_uint;
    release_geometry = rtcReleaseGeometry: fn(Handle);
    intersect1 = rtcIntersect1: fn(Handle, *mut RayHit, *const QueryArguments);
    occluded1 = rtcOccluded1: fn(Handle, *mut Ray, *const QueryArguments);
    intersect8 = rtcIntersect8: fn(*const c_int, Handle, *mut Packet<8>, *const QueryArguments);
    occluded8 = rtcOccluded8: fn(*const c_int, Handle, *mut Packet<8>, *const QueryArguments);
    intersect16 = rtcIntersect16: fn(*const c_int, Handle, *mut Packet<16>, *const QueryArguments);
    occluded16 = rtcOccluded16: fn(*const c_int, Handle, *mut Packet<16>, *const QueryArguments);
}

impl Embree {
    /// Loads the library from `folder`, which holds an unpacked wheel of embreex, or else the system's.
    pub fn open(folder: &Path) -> Result<Embree, String> {
        let found = |start: &str| -> Option<PathBuf> {
            let entries = std::fs::read_dir(folder).ok()?.flatten();
            entries
                .map(|e| e.path())
                .find(|p| p.file_name().is_some_and(|n| n.to_string_lossy().starts_with(start)))
        };
        let path = found("libembree4").unwrap_or_else(|| "libembree4.so.4".into());
        // SAFETY: loading Embree and TBB runs only their own initialisers.
        let open = |path: &Path| unsafe { Library::new(path) };
        // The wheel's Embree finds its TBB if that is loaded first.
        let needed = found("libtbb").and_then(|path| open(&path).ok());
        let bound = open(&path).and_then(|library| Embree::bind(library, needed));
        bound.map_err(|e| format!("no Embree 4 in {}: {e}; `just bench-peers` fetches it", folder.display()))
    }

    pub fn intersect<const N: usize>(&self) -> Option<PacketFunction<N>> {
        self.packets(self.intersect8, self.intersect16)
    }

    pub fn occluded<const N: usize>(&self) -> Option<PacketFunction<N>> {
        self.packets(self.occluded8, self.occluded16)
    }

    /// The function of packet width `N`.
    fn packets<const N: usize>(
        &self,
        eight: PacketFunction<8>,
        sixteen: PacketFunction<16>,
    ) -> Option<PacketFunction<N>> {
        // SAFETY: source and target are the same type where N matches.
        unsafe {
            match N {
                8 => Some(std::mem::transmute::<PacketFunction<8>, PacketFunction<N>>(eight)),
                16 => Some(std::mem::transmute::<PacketFunction<16>, PacketFunction<N>>(sixteen)),
                _ => None,
            }
        }
    }
}

/// Bytes that Embree has allocated, for all devices.
static ALLOCATED_BYTES: AtomicIsize = AtomicIsize::new(0);

extern "C" fn count(_: Handle, bytes: isize, _: bool) -> bool {
    ALLOCATED_BYTES.fetch_add(bytes, Ordering::Relaxed);
    true
}

/// A committed scene.
pub struct EmbreeScene<'e> {
    embree: &'e Embree,
    device: Handle,
    pub handle: Handle,
    /// The scenes of instanced meshes.
    mesh_scenes: Vec<Handle>,
    /// Build time in seconds.
    pub seconds: f64,
    /// Memory of the BVHs with their copies of triangles, in bytes.
    pub bytes: usize,
}

// SAFETY: committed scenes may be traced from several threads.
unsafe impl Sync for EmbreeScene<'_> {}

impl<'e> EmbreeScene<'e> {
    /// Builds `scene` at medium quality. A scene without instancing becomes one geometry, which Embree traces fastest.
    pub fn new(
        embree: &'e Embree,
        scene: &GeneratedScene,
        threads: usize,
        robust: bool,
    ) -> Result<EmbreeScene<'e>, String> {
        let settings =
            CString::new(format!("threads={threads},set_affinity=0")).map_err(|e| e.to_string())?;
        // SAFETY: handles are used as Embree's manual specifies, and released in `drop`.
        let mut built = unsafe {
            let device = (embree.new_device)(settings.as_ptr());
            (embree.monitor)(device, count, null_mut());
            EmbreeScene {
                embree,
                device,
                handle: null_mut(),
                mesh_scenes: Vec::new(),
                seconds: 0.0,
                bytes: 0,
            }
        };
        if scene.stored_triangles() == scene.drawn_triangles() {
            let mut all = GeneratedMesh::default();
            for i in &scene.instances {
                let (mesh, base) = (&scene.meshes[i.mesh], all.positions.len() as u32);
                all.positions.extend(mesh.positions.iter().map(|&p| i.transform_point(p)));
                all.triangles.extend(mesh.triangles.iter().map(|t| t.map(|v| v + base)));
            }
            built.handle = built.mesh(&all, robust);
        } else {
            let meshes: Vec<Handle> = scene.meshes.iter().map(|m| built.mesh(m, robust)).collect();
            built.handle = built.instances(&scene.instances, &meshes, robust);
            built.mesh_scenes = meshes;
        }
        // SAFETY: the device lives.
        match unsafe { (embree.device_error)(built.device) } {
            0 => Ok(built),
            code => Err(format!("Embree's error {code} while building {}", scene.name)),
        }
    }

    fn scene(&self, robust: bool) -> Handle {
        // SAFETY: the device lives.
        unsafe {
            let scene = (self.embree.new_scene)(self.device);
            (self.embree.quality)(scene, 1);
            (self.embree.scene_flags)(scene, if robust { 4 } else { 0 });
            scene
        }
    }

    fn mesh(&mut self, mesh: &GeneratedMesh, robust: bool) -> Handle {
        let (scene, e) = (self.scene(robust), self.embree);
        // SAFETY: Embree's buffers have the requested size.
        unsafe {
            let geometry = (e.new_geometry)(self.device, 0);
            let vertices = (e.new_buffer)(geometry, 1, 0, 0x9003, 12, mesh.positions.len());
            mesh.positions.as_ptr().copy_to_nonoverlapping(vertices.cast(), mesh.positions.len());
            let indices = (e.new_buffer)(geometry, 0, 0, 0x5003, 12, mesh.triangles.len());
            mesh.triangles.as_ptr().copy_to_nonoverlapping(indices.cast(), mesh.triangles.len());
            self.finish(scene, &[geometry]);
        }
        scene
    }

    fn instances(&mut self, instances: &[GeneratedInstance], meshes: &[Handle], robust: bool) -> Handle {
        let (scene, e) = (self.scene(robust), self.embree);
        // SAFETY: the meshes' scenes are committed and live as long as this one.
        unsafe {
            let placed = |i: &GeneratedInstance| {
                let geometry = (e.new_geometry)(self.device, 121);
                (e.instanced)(geometry, meshes[i.mesh]);
                (e.transform)(geometry, 0, 0x9234, i.columns.as_ptr().cast());
                geometry
            };
            let geometries: Vec<Handle> = instances.iter().map(placed).collect();
            self.finish(scene, &geometries);
        }
        scene
    }

    /// SAFETY: handles of this device.
    unsafe fn finish(&mut self, scene: Handle, geometries: &[Handle]) {
        let e = self.embree;
        unsafe {
            for &geometry in geometries {
                (e.commit_geometry)(geometry);
                (e.attach)(scene, geometry);
                (e.release_geometry)(geometry);
            }
            let (before, start) = (ALLOCATED_BYTES.load(Ordering::Relaxed), Instant::now());
            (e.commit_scene)(scene);
            self.seconds += start.elapsed().as_secs_f64();
            self.bytes += (ALLOCATED_BYTES.load(Ordering::Relaxed) - before).max(0) as usize;
        }
    }

    pub fn embree(&self) -> &'e Embree {
        self.embree
    }
}

impl Drop for EmbreeScene<'_> {
    fn drop(&mut self) {
        // SAFETY: each handle was created once and is released once.
        unsafe {
            (self.embree.release_scene)(self.handle);
            self.mesh_scenes.iter().for_each(|&scene| (self.embree.release_scene)(scene));
            (self.embree.release_device)(self.device);
        }
    }
}
