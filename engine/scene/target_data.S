/* The targets that are built in: data/targets, see engine/scene/built_in_targets.h. */
  .macro target name
  .global starloop_target_\name
  .global starloop_target_\name\()_end
starloop_target_\name:
  .incbin "targets/\name\().toml"
starloop_target_\name\()_end:
  .byte 0
  .endm
  .section .rodata
  target cubesat
  target plate
  target rocket_body
  target sphere
  target telescope
  .section .note.GNU-stack, "", %progbits
