/// \file The program for this processor, where several are installed.
#pragma once

namespace lahar {

/// A portable installation has programs for several levels of processors
/// (PREFIX/libexec/lahar/x86-64-v3 and -v4), and this one for all. Goes on as the best that this
/// processor can run; returns where there is none. The environment variable LAHAR_LEVEL names
/// another one: baseline, x86-64-v3, x86-64-v4.
void become_best_level(char** argv);

}  // namespace lahar
