//! Kinds with names and codes.

/// Declares an enumeration. Each kind has a name in files and reports, and a code: its place, from 0. Kinds may also
/// have a description in words.
#[macro_export]
macro_rules! named {
    ($(#[$about:meta])* $visible:vis enum $name:ident {
        $($(#[$of_kind:meta])* $kind:ident: $word:literal,)*
    }) => {
        $(#[$about])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        $visible enum $name {
            $($(#[$of_kind])* $kind,)*
        }

        impl $name {
            /// All kinds, in the order of their codes.
            pub const ALL: &'static [Self] = &[$(Self::$kind),*];

            /// Name in files and reports.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$kind => $word,)*
                }
            }

            /// Codes and names of all kinds.
            pub fn codes() -> Vec<(i64, String)> {
                (0..).zip(Self::ALL.iter().map(|kind| kind.name().to_owned())).collect()
            }
        }

        impl ::serde::Serialize for $name {
            fn serialize<S: ::serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.serialize_str(self.name())
            }
        }
    };
    ($(#[$about:meta])* $visible:vis enum $name:ident {
        $($(#[$of_kind:meta])* $kind:ident: $word:literal, $words:literal;)*
    }) => {
        $crate::named! {
            $(#[$about])*
            $visible enum $name {
                $(#[doc = $words] $(#[$of_kind])* $kind: $word,)*
            }
        }

        impl $name {
            /// Description in words.
            pub fn words(self) -> &'static str {
                match self {
                    $(Self::$kind => $words,)*
                }
            }
        }
    };
}
