// The shortest way from a program's call to the driver: libglvnd's own stubs, rewritten.
//
//   not rewritten:  stub (load the thread's table, jump by it) -> wrapper (test, jump) -> driver
//   rewritten:      stub (jump by the slot) -> driver      while nothing in the process concerns the layer
//                   stub (jump by the slot) -> wrapper     from engage() on
//
// libglvnd asks for each function once and keeps the answer, so what it is given must be right for ever: the wrapper. But it
// lets a vendor rewrite its stubs when a context is made current while no other thread has one (glvnd/libeglabi.h,
// isPatchSupported and initiatePatch), and a stub of ours jumps by a slot that changes once, at engage().
// Where stubs cannot be rewritten (another processor than x86-64, stubs made later for names that libglvnd does not know,
// __GLVND_DISALLOW_PATCHING=1) calls take the longer way, with the same results.
// As long as stubs are rewritten, libglvnd refuses contexts of another vendor on other threads meanwhile.
// Threads: any; libglvnd rewrites under its lock. Errors: none.
#pragma once

namespace fovea::layer {

// Of libglvnd, whose header cannot be read beside those of OpenGL ES: where to write the stub of a function, and where it will
// run. 0: there is none.
using LookupStub = unsigned char (*)(const char* name, void** write, const void** run);

// Can stubs for x86-64 of `bytes` bytes be rewritten?
[[nodiscard]] bool can_rewrite_stubs(int bytes) noexcept;
// Called by libglvnd within initiatePatch. `address` is the layer's getProcAddress, `driver_address` the driver's.
void rewrite_stubs(LookupStub lookup, void* (*address)(const char*), void* (*driver_address)(const char*));

// Something in this process concerns the layer now: a foveated framebuffer or texture, a program of several views, auto mode.
void engage() noexcept;

}  // namespace fovea::layer
