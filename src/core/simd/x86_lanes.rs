//! The implementation of [`Lanes`] that the x86 instruction sets share.
//!
//! [`Lanes`]: crate::simd::lanes::Lanes

/// Implements `Lanes<N>` and the arithmetic operators for a register type by its intrinsics. `$mask_bits` converts the
/// result of `$cmp` to a bit mask; `$select(mask, a, b)` returns a where the bit of `mask` is set, else b.
macro_rules! impl_x86_lanes {
    ($name:ident, $n:literal, $set1:ident, $load:ident, $store:ident, $add:ident, $sub:ident,
     $mul:ident, $div:ident, $fmadd:ident, $fmsub:ident, $min:ident, $max:ident, $and:ident, $andnot:ident,
     $xor:ident, $cmp:ident, $mask_bits:path, $select:ident, { $($own:tt)* }) => {
        impl Add for $name {
            type Output = Self;
            #[inline(always)]
            fn add(self, o: Self) -> Self {
                // SAFETY: see the comment of the module that calls this macro, here and below.
                $name(unsafe { $add(self.0, o.0) })
            }
        }
        impl Sub for $name {
            type Output = Self;
            #[inline(always)]
            fn sub(self, o: Self) -> Self {
                $name(unsafe { $sub(self.0, o.0) })
            }
        }
        impl Mul for $name {
            type Output = Self;
            #[inline(always)]
            fn mul(self, o: Self) -> Self {
                $name(unsafe { $mul(self.0, o.0) })
            }
        }
        impl Div for $name {
            type Output = Self;
            #[inline(always)]
            fn div(self, o: Self) -> Self {
                $name(unsafe { $div(self.0, o.0) })
            }
        }
        impl Lanes<$n> for $name {
            #[inline(always)]
            fn splat(x: f32) -> Self {
                $name(unsafe { $set1(x) })
            }
            #[inline(always)]
            fn load(from: &[f32; $n]) -> Self {
                // SAFETY: as above; `from` has the size of a register.
                $name(unsafe { $load(from.as_ptr()) })
            }
            #[inline(always)]
            fn store(self, to: &mut [f32; $n]) {
                // SAFETY: as above; `to` has the size of a register.
                unsafe { $store(to.as_mut_ptr(), self.0) }
            }
            #[inline(always)]
            fn mul_add(self, b: Self, c: Self) -> Self {
                $name(unsafe { $fmadd(self.0, b.0, c.0) })
            }
            #[inline(always)]
            fn mul_sub(self, b: Self, c: Self) -> Self {
                $name(unsafe { $fmsub(self.0, b.0, c.0) })
            }
            // The instruction returns its second operand if either is NaN.
            #[inline(always)]
            fn min(self, o: Self) -> Self {
                $name(unsafe { $min(self.0, o.0) })
            }
            #[inline(always)]
            fn max(self, o: Self) -> Self {
                $name(unsafe { $max(self.0, o.0) })
            }
            #[inline(always)]
            fn abs(self) -> Self {
                $name(unsafe { $andnot($set1(-0.0), self.0) })
            }
            #[inline(always)]
            fn xor_sign(self, o: Self) -> Self {
                $name(unsafe { $xor(self.0, $and($set1(-0.0), o.0)) })
            }
            #[inline(always)]
            fn floor_power_of_two(self) -> Self {
                $name(unsafe { $and($set1(f32::INFINITY), self.0) })
            }
            #[inline(always)]
            fn lt(self, o: Self) -> u32 {
                $mask_bits(unsafe { $cmp::<_CMP_LT_OQ>(self.0, o.0) })
            }
            #[inline(always)]
            fn le(self, o: Self) -> u32 {
                $mask_bits(unsafe { $cmp::<_CMP_LE_OQ>(self.0, o.0) })
            }
            #[inline(always)]
            fn select(self, mask: u32, o: Self) -> Self {
                $name($select(mask, self.0, o.0))
            }
            $($own)*
        }
    };
}

pub(crate) use impl_x86_lanes;
