//! The macros from which a message's struct and its description come together.

/// Defines a message: the struct (fields in wire order), its [`RosMessage`](crate::RosMessage)
/// implementation, and what a field of it is.
///
/// `field: u8 as Byte` writes the field as the `byte` of the interface language, which type hashes
/// tell from `uint8`.
macro_rules! ros_message {
    (
        $type_name:literal, $path:literal, $part:ident;
        $(#[$meta:meta])*
        pub struct $name:ident { $( $(#[$field_meta:meta])* pub $field:ident: $ty:ty $(as $element:ident)?, )* }
        $( $(#[$const_meta:meta])* const $constant:ident: $const_ty:ty = $value:expr; )*
    ) => {
        $(#[$meta])*
        #[derive(Clone, Debug, PartialEq, ::serde::Serialize, ::serde::Deserialize)]
        pub struct $name { $( $(#[$field_meta])* pub $field: $ty, )* }

        #[allow(dead_code)]
        impl $name {
            $( $(#[$const_meta])* pub const $constant: $const_ty = $value; )*
        }

        impl $crate::RosMessage for $name {
            const TYPE_NAME: &'static str = $type_name;
            const TYPE: &'static $crate::MessageType = &$crate::MessageType {
                name: $type_name,
                file_text: include_str!($path),
                part: $crate::Part::$part,
                fields: &[$(
                    $crate::Field {
                        name: stringify!($field),
                        field_type: <$ty as $crate::RosField>::FIELD_TYPE$(.with_element($crate::Element::$element))?,
                    },
                )*],
                constants: &[$( (stringify!($constant), $value as i64), )*],
            };
        }

        impl $crate::RosElement for $name {
            const ELEMENT: $crate::Element = $crate::Element::Message(<$name as $crate::RosMessage>::TYPE);
        }

        impl $crate::RosField for $name {
            const FIELD_TYPE: $crate::FieldType =
                $crate::FieldType { element: <$name as $crate::RosElement>::ELEMENT, arity: $crate::Arity::One };
        }
    };
}

/// Defines the marker type of a service from its name and its two message types.
macro_rules! ros_service {
    ($(#[$meta:meta])* $type_name:literal, $name:ident, $request:ident, $response:ident) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub struct $name;

        impl $crate::RosService for $name {
            const TYPE_NAME: &'static str = $type_name;
            type Request = $request;
            type Response = $response;
        }
    };
}
