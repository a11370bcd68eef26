# Not tried. A tap of one's own has this as Formula/gart.rb.
class Gart < Formula
  desc "Ray-traced 3D Gaussians: training and rendering"
  homepage "https://example.org/gart"
  url "https://example.org/gart-0.1.0.tar.gz" # that of a release
  sha256 "0" * 64
  license "Apache-2.0"

  depends_on "cli11" => :build
  depends_on "cmake" => :build
  depends_on "ninja" => :build
  depends_on "nlohmann-json" => :build
  depends_on "glm"
  depends_on "jpeg-turbo"
  depends_on "libomp"
  depends_on "libpng"
  depends_on "webp"
  depends_on "zstd"

  def install
    system "cmake", "-S", ".", "-B", "build", "-G", "Ninja", "-DGART_NATIVE=OFF", "-DGART_PYTHON=OFF",
           "-DGART_BUILD_TESTS=OFF", "-DGART_BUILD_EXAMPLES=OFF", "-DGART_DISTRIBUTED=OFF", *std_cmake_args
    system "cmake", "--build", "build"
    system "cmake", "--install", "build"
  end

  test do
    system bin/"gart", "info", "--self-test"
  end
end
