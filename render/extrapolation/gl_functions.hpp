// The OpenGL ES entry points that the GL side of the engine calls, loaded from the driver itself.
//
// A table instead of linked names: behind the GLES layer the process-wide names lead back into the layer.
// Threads: plain data.
#pragma once

#include <cstdio>

#include <GLES3/gl32.h>

namespace fovea::render::extrapolation {

// Returns the driver's function of that name, or null; eglGetProcAddress has this shape.
using GlFunction = void (*)();
using GlLoader = GlFunction (*)(const char* name);

#define FOVEA_EXTRAPOLATION_GL(X)                                                                                       \
    X(ActiveTexture, ACTIVETEXTURE) X(AttachShader, ATTACHSHADER) X(BindBuffer, BINDBUFFER)                             \
    X(BindFramebuffer, BINDFRAMEBUFFER) X(BindSampler, BINDSAMPLER)                                                     \
    X(BindTexture, BINDTEXTURE) X(BindVertexArray, BINDVERTEXARRAY) X(BlitFramebuffer, BLITFRAMEBUFFER)                 \
    X(BufferData, BUFFERDATA) X(CheckFramebufferStatus, CHECKFRAMEBUFFERSTATUS) X(ClearBufferfv, CLEARBUFFERFV)         \
    X(ClearBufferuiv, CLEARBUFFERUIV) X(DeleteBuffers, DELETEBUFFERS)                                                   \
    X(ColorMask, COLORMASK) X(CompileShader, COMPILESHADER) X(CreateProgram, CREATEPROGRAM)                             \
    X(CreateShader, CREATESHADER) X(DeleteFramebuffers, DELETEFRAMEBUFFERS) X(DeleteProgram, DELETEPROGRAM)             \
    X(DeleteSamplers, DELETESAMPLERS) X(DeleteShader, DELETESHADER) X(DeleteTextures, DELETETEXTURES)                   \
    X(DeleteVertexArrays, DELETEVERTEXARRAYS) X(Disable, DISABLE)                                                       \
    X(DrawArrays, DRAWARRAYS) X(DrawBuffers, DRAWBUFFERS) X(Enable, ENABLE) X(Finish, FINISH)                           \
    X(FramebufferTexture2D, FRAMEBUFFERTEXTURE2D) X(GenBuffers, GENBUFFERS) X(GenFramebuffers, GENFRAMEBUFFERS) X(GenSamplers, GENSAMPLERS)\
    X(GenTextures, GENTEXTURES) X(GenVertexArrays, GENVERTEXARRAYS) X(GetBooleanv, GETBOOLEANV) X(GetError, GETERROR)   \
    X(GetFramebufferAttachmentParameteriv, GETFRAMEBUFFERATTACHMENTPARAMETERIV)                                         \
    X(GetIntegeri_v, GETINTEGERI_V) X(GetIntegerv, GETINTEGERV) X(GetProgramInfoLog, GETPROGRAMINFOLOG)                 \
    X(GetProgramiv, GETPROGRAMIV) X(GetShaderInfoLog, GETSHADERINFOLOG) X(GetShaderiv, GETSHADERIV)                     \
    X(GetQueryiv, GETQUERYIV) X(GetString, GETSTRING) X(GetStringi, GETSTRINGI) X(GetTexParameteriv, GETTEXPARAMETERIV) \
    X(GetUniformLocation, GETUNIFORMLOCATION) X(IsEnabled, ISENABLED) X(IsTexture, ISTEXTURE)                           \
    X(LinkProgram, LINKPROGRAM) X(PauseTransformFeedback, PAUSETRANSFORMFEEDBACK) X(ResumeTransformFeedback, RESUMETRANSFORMFEEDBACK)\
    X(MapBufferRange, MAPBUFFERRANGE) X(PixelStorei, PIXELSTOREI) X(ReadPixels, READPIXELS)                             \
    X(SamplerParameteri, SAMPLERPARAMETERI) X(ShaderSource, SHADERSOURCE) X(TexParameteri, TEXPARAMETERI)               \
    X(TexStorage2D, TEXSTORAGE2D) X(TexSubImage2D, TEXSUBIMAGE2D) X(Uniform1f, UNIFORM1F) X(Uniform1i, UNIFORM1I)       \
    X(Uniform2i, UNIFORM2I) X(Uniform4i, UNIFORM4I) X(UnmapBuffer, UNMAPBUFFER)                                         \
    X(UseProgram, USEPROGRAM) X(Viewport, VIEWPORT)

// Of OpenGL ES 3.1. A driver may hand out functions that the current context has not: calling one is an error there.
#define FOVEA_EXTRAPOLATION_GL31(X)                                                                                     \
    X(BindImageTexture, BINDIMAGETEXTURE) X(DispatchCompute, DISPATCHCOMPUTE)                                           \
    X(DispatchComputeIndirect, DISPATCHCOMPUTEINDIRECT) X(DrawArraysIndirect, DRAWARRAYSINDIRECT)                       \
    X(GetTexLevelParameteriv, GETTEXLEVELPARAMETERIV) X(MemoryBarrier, MEMORYBARRIER)

// What extensions, or OpenGL ES 3.2, add to the state that a pass meets.
using GlViewportIndexed = void(GL_APIENTRYP)(GLuint index, const GLfloat* box);
using GlGetFloatIndexed = void(GL_APIENTRYP)(GLenum what, GLuint index, GLfloat* values);
using GlClipControl = void(GL_APIENTRYP)(GLenum origin, GLenum depth);

struct GlFunctions {
#define X(name, type) PFNGL##type##PROC name = nullptr;
    FOVEA_EXTRAPOLATION_GL(X)
    FOVEA_EXTRAPOLATION_GL31(X)   // null below
#undef X
    int version = 0;                               // of the context: 30, 31, 32; 0 where none is current
    // Null where the context has not the state that goes with them.
    PFNGLENABLEIPROC Enablei = nullptr;            // one draw buffer's or one viewport's
    PFNGLDISABLEIPROC Disablei = nullptr;
    PFNGLISENABLEDIPROC IsEnabledi = nullptr;
    PFNGLCOLORMASKIPROC ColorMaski = nullptr;
    PFNGLGETBOOLEANI_VPROC GetBooleani_v = nullptr;
    GlViewportIndexed ViewportIndexedfv = nullptr;
    GlGetFloatIndexed GetFloati_v = nullptr;
    GlClipControl ClipControl = nullptr;
    bool reverses_rows = false;                    // GL_ANGLE_pack_reverse_row_order
    bool counts_primitives = false;                // queries of primitives that are generated: OpenGL ES 3.2
    int clip_distances = 0;                        // GL_EXT_clip_cull_distance, GL_APPLE_clip_distance
};

// The first name of the current context's version that the driver does not have; null if it has all of them.
[[nodiscard]] inline const char* load(GlFunctions& gl, GlLoader loader) noexcept {
    const char* missing = nullptr;
#define X(name, type)                                                           \
    gl.name = reinterpret_cast<PFNGL##type##PROC>(loader("gl" #name));          \
    if (gl.name == nullptr && missing == nullptr) missing = "gl" #name;
    FOVEA_EXTRAPOLATION_GL(X)
    if (missing != nullptr) return missing;
    const auto* version = reinterpret_cast<const char*>(gl.GetString(GL_VERSION));
    if (version == nullptr) return nullptr;
    int major = 3, minor = 1;   // what calls itself otherwise is taken as one that has all
    if (std::sscanf(version, "OpenGL ES %d.%d", &major, &minor) == 1) minor = 0;
    gl.version = major * 10 + minor;
    if (gl.version < 31) return nullptr;
    FOVEA_EXTRAPOLATION_GL31(X)
#undef X
    return missing;
}

// Adds what the current context has beyond that.
void load_optional(GlFunctions& gl, GlLoader loader) noexcept;

}  // namespace fovea::render::extrapolation
