//! Messages as plain numbers: the form in which they lie in shared memory, and the way there and back.
//!
//! Whoever opens a topic can put any bits into it, and a Rust enum made of bits that name none of its variants is
//! undefined behaviour. So shared memory holds a [`Message::Wire`], of which every bit pattern is a value
//! (`zerocopy::FromBytes`: the compiler proves it), and only [`Message::from_wire`] makes a message of it.

use super::check::Wrong;
use iceoryx2::prelude::ZeroCopySend;
use std::fmt::Debug;
use zerocopy::{FromBytes, Immutable, IntoBytes};

/// What a topic carries.
pub trait Message: Debug + Copy + 'static {
    /// The message in plain numbers: `repr(C)`, without gaps, any bits are a value.
    type Wire: Debug + Copy + ZeroCopySend + FromBytes + IntoBytes + Immutable + 'static;

    /// The message in plain numbers.
    fn to_wire(&self) -> Self::Wire;

    /// The message behind numbers that anybody may have written.
    ///
    /// # Errors
    /// [`Wrong`] names the first field that no message holds.
    fn from_wire(wire: &Self::Wire) -> Result<Self, Wrong>;
}

/// A field of a message and its plain form.
pub trait Field: Sized {
    /// The plain form: the field itself, or the number of a variant.
    type Wire;

    /// The field in plain form.
    fn to_wire(self) -> Self::Wire;

    /// The field behind a plain form that anybody may have written; `field` is its name.
    ///
    /// # Errors
    /// [`Wrong::Code`] when a number is that of no variant.
    fn from_wire(field: &'static str, wire: Self::Wire) -> Result<Self, Wrong>;
}

/// Fields that are plain already.
macro_rules! plain_fields {
    ($([$($parameter:tt)*] $field:ty),+ $(,)?) => {$(
        impl<$($parameter)*> $crate::msg::wire::Field for $field {
            type Wire = Self;
            fn to_wire(self) -> Self {
                self
            }
            fn from_wire(_: &'static str, wire: Self) -> Result<Self, $crate::msg::check::Wrong> {
                Ok(wire)
            }
        }
    )+};
}
plain_fields!([] u32, [] u64, [] f64, [const N: usize] [f64; N], [const N: usize] [u8; N]);
pub(super) use plain_fields;

/// Makes an enum a field that travels as a `u32`. Does not compile while a variant is missing.
macro_rules! codes {
    ($name:ident: $($variant:ident),+ $(,)?) => {
        impl $crate::msg::wire::Field for $name {
            type Wire = u32;
            fn to_wire(self) -> u32 {
                match self {
                    $(Self::$variant => Self::$variant as u32,)+
                }
            }
            fn from_wire(field: &'static str, code: u32) -> Result<Self, $crate::msg::check::Wrong> {
                let variants = [$(Self::$variant),+];
                let named = variants.into_iter().find(|variant| *variant as u32 == code);
                named.ok_or($crate::msg::check::Wrong::Code { field, code })
            }
        }
    };
}
pub(super) use codes;

/// Defines the plain form of a message, all fields in their order, and with it [`Message`]; the message has a method `check`.
/// `ZeroCopySend` must be in scope: what it derives names it so.
macro_rules! wire {
    ($version:literal $wire:ident: $message:ident { $($field:ident: $kind:ty),+ $(,)? }) => {
        #[doc = concat!("[`", stringify!($message), "`] in plain numbers.")]
        #[derive(
            Debug, Clone, Copy, PartialEq,
            ZeroCopySend, zerocopy::FromBytes, zerocopy::IntoBytes, zerocopy::Immutable,
        )]
        #[type_name($version)]
        #[repr(C)]
        #[allow(non_snake_case)] // the field's own symbols
        pub struct $wire {
            $(
                #[doc = concat!("[`", stringify!($message), "::", stringify!($field), "`].")]
                pub $field: <$kind as $crate::msg::wire::Field>::Wire,
            )+
        }

        impl $crate::msg::Message for $message {
            type Wire = $wire;
            fn to_wire(&self) -> $wire {
                $wire { $($field: $crate::msg::wire::Field::to_wire(self.$field),)+ }
            }
            fn from_wire(wire: &$wire) -> Result<Self, $crate::msg::check::Wrong> {
                let message = Self {
                    $($field: <$kind as $crate::msg::wire::Field>::from_wire(stringify!($field), wire.$field)?,)+
                };
                message.check()?;
                Ok(message)
            }
        }
    };
}
pub(super) use wire;

/// Implements [`Message`] for a message of plain numbers that has a method `check`.
macro_rules! plain {
    ($message:ident) => {
        impl $crate::msg::Message for $message {
            type Wire = Self;
            fn to_wire(&self) -> Self {
                *self
            }
            fn from_wire(wire: &Self) -> Result<Self, $crate::msg::check::Wrong> {
                wire.check()?;
                Ok(*wire)
            }
        }
    };
}
pub(super) use plain;
