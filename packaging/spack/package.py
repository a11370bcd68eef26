# Not tried. A repository of one's own has this as packages/gart/package.py.
from spack.package import *


class Gart(CMakePackage, CudaPackage):
    """Ray-traced 3D Gaussians: training and rendering."""

    homepage = "https://example.org/gart"
    url = "https://example.org/gart-0.1.0.tar.gz"  # that of a release

    license("Apache-2.0")
    version("0.1.0", sha256="0" * 64)  # the release's checksum

    variant("embree", default=True, description="The Embree tracer")
    variant("mpi", default=False, description="Training on several ranks")
    variant("python", default=False, description="The Python module")
    variant("shared", default=True, description="Shared libraries")

    depends_on("cxx", type="build")
    depends_on("cmake@3.22:", type="build")
    depends_on("glm")
    depends_on("cli11", type="build")
    depends_on("nlohmann-json", type="build")
    depends_on("libpng")
    depends_on("libjpeg-turbo")
    depends_on("libwebp")
    depends_on("zstd")
    depends_on("zlib-api")
    depends_on("embree", when="+embree")
    depends_on("mpi", when="+mpi")
    depends_on("cuda@12:", when="+cuda")
    extends("python", when="+python")
    depends_on("py-nanobind@2.5:", type="build", when="+python")
    depends_on("py-numpy", type="run", when="+python")

    def cmake_args(self):
        args = [
            self.define_from_variant("GART_CUDA", "cuda"),
            self.define_from_variant("GART_EMBREE", "embree"),
            self.define_from_variant("GART_DISTRIBUTED", "mpi"),
            self.define_from_variant("GART_PYTHON", "python"),
            self.define_from_variant("BUILD_SHARED_LIBS", "shared"),
            self.define("GART_NATIVE", False),
            self.define("GART_BUILD_TESTS", self.run_tests),
            self.define("GART_BUILD_EXAMPLES", False),
        ]
        if "+python" in self.spec:
            args.append(self.define("GART_PYTHON_FOLDER", python_platlib))
        if "+cuda" in self.spec:
            args.append(self.define("CMAKE_CUDA_ARCHITECTURES", self.spec.variants["cuda_arch"].value))
        return args
