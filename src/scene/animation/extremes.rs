//! Extremes over vertices: bounding boxes and farthest distances, with the vertices that attain them.

use glam::DVec3;

use blinn_core::geometry::Aabb;

/// A vertex of an instance at one of the sampled times.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct VertexAt {
    /// Index of the time; 0 for a single pose.
    pub time: u32,
    pub instance: u32,
    pub vertex: u32,
}

/// An extreme over points.
pub(super) trait Extremes: Copy + Send + Sync {
    /// Returns true if points in `bounds` cannot change the result.
    fn covers(&self, bounds: &Aabb) -> bool;
    /// Includes a point. Ignores points that are not finite.
    fn add(&mut self, p: DVec3, vertex: VertexAt);
    /// Merges the results of two threads.
    fn join(self, other: Self) -> Self;
    /// Returns the vertices that attain the result, one for each part of it, such as a side of a box.
    fn vertices(&self) -> Vec<(usize, VertexAt)>;
    /// Returns true if `p` attains a part of the result, too.
    fn attains(&self, part: usize, p: DVec3) -> bool;
}

/// A bounding box.
#[derive(Clone, Copy, Debug)]
pub(super) struct BoxExtremes {
    pub bounds: Aabb,
    lowest: [VertexAt; 3],
    highest: [VertexAt; 3],
}

impl BoxExtremes {
    /// The empty box.
    pub const EMPTY: BoxExtremes = {
        let none = VertexAt { time: 0, instance: 0, vertex: 0 };
        BoxExtremes { bounds: Aabb::EMPTY, lowest: [none; 3], highest: [none; 3] }
    };
}

impl Extremes for BoxExtremes {
    fn covers(&self, bounds: &Aabb) -> bool {
        self.bounds.contains_box(bounds)
    }

    #[inline(always)]
    fn add(&mut self, p: DVec3, vertex: VertexAt) {
        let Aabb { min, max } = &mut self.bounds;
        // Most points change nothing.
        if (p.cmpge(*min) & p.cmple(*max)).all() || !p.is_finite() {
            return;
        }
        for k in 0..3 {
            if p[k] < min[k] {
                min[k] = p[k];
                self.lowest[k] = vertex;
            }
            if p[k] > max[k] {
                max[k] = p[k];
                self.highest[k] = vertex;
            }
        }
    }

    fn join(mut self, other: Self) -> Self {
        for k in 0..3 {
            if other.bounds.min[k] < self.bounds.min[k] {
                self.bounds.min[k] = other.bounds.min[k];
                self.lowest[k] = other.lowest[k];
            }
            if other.bounds.max[k] > self.bounds.max[k] {
                self.bounds.max[k] = other.bounds.max[k];
                self.highest[k] = other.highest[k];
            }
        }
        self
    }

    fn vertices(&self) -> Vec<(usize, VertexAt)> {
        if self.bounds.is_empty() {
            return Vec::new();
        }
        self.lowest.into_iter().chain(self.highest).enumerate().collect()
    }

    fn attains(&self, part: usize, p: DVec3) -> bool {
        match part {
            0..3 => p[part] == self.bounds.min[part],
            _ => p[part - 3] == self.bounds.max[part - 3],
        }
    }
}

/// The greatest distance from a centre.
#[derive(Clone, Copy, Debug)]
pub(super) struct FarthestVertex {
    centre: DVec3,
    /// Squared distance.
    pub distance_squared: f64,
    vertex: Option<VertexAt>,
}

impl FarthestVertex {
    /// Begins at the centre.
    pub fn from(centre: DVec3) -> FarthestVertex {
        FarthestVertex { centre, distance_squared: 0.0, vertex: None }
    }
}

impl Extremes for FarthestVertex {
    fn covers(&self, bounds: &Aabb) -> bool {
        bounds.max_distance_squared(self.centre) <= self.distance_squared
    }

    #[inline(always)]
    fn add(&mut self, p: DVec3, vertex: VertexAt) {
        let distance_squared = p.distance_squared(self.centre);
        if distance_squared > self.distance_squared && p.is_finite() {
            self.distance_squared = distance_squared;
            self.vertex = Some(vertex);
        }
    }

    fn join(self, other: Self) -> Self {
        if other.distance_squared > self.distance_squared { other } else { self }
    }

    fn vertices(&self) -> Vec<(usize, VertexAt)> {
        self.vertex.into_iter().map(|vertex| (0, vertex)).collect()
    }

    fn attains(&self, _part: usize, p: DVec3) -> bool {
        p.distance_squared(self.centre) == self.distance_squared
    }
}

/// A bounding box that counts the points it is given.
#[cfg(test)]
#[derive(Clone, Copy)]
pub(super) struct CountingBox {
    extremes: BoxExtremes,
    pub points: usize,
}

#[cfg(test)]
impl Default for CountingBox {
    fn default() -> Self {
        CountingBox { extremes: BoxExtremes::EMPTY, points: 0 }
    }
}

#[cfg(test)]
impl Extremes for CountingBox {
    fn covers(&self, bounds: &Aabb) -> bool {
        self.extremes.covers(bounds)
    }

    fn add(&mut self, p: DVec3, vertex: VertexAt) {
        self.extremes.add(p, vertex);
        self.points += 1;
    }

    fn join(self, other: Self) -> Self {
        CountingBox { extremes: self.extremes.join(other.extremes), points: self.points + other.points }
    }

    fn vertices(&self) -> Vec<(usize, VertexAt)> {
        self.extremes.vertices()
    }

    fn attains(&self, part: usize, p: DVec3) -> bool {
        self.extremes.attains(part, p)
    }
}
