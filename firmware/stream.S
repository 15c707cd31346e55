/* The recorded sensors, made by crates/arm-sim/examples/stream.rs. */
  .section .stream, "a"
  .balign 8
  .incbin STREAM
  .section .note.GNU-stack, "", %progbits
