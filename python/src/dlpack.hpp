#pragma once
// DLPack's structures (github.com/dmlc/dlpack, version 0.8), as libraries exchange them under the capsule name
// "dltensor".

#include <cstdint>

namespace gart_python {

enum dl_device_type : std::int32_t { dl_cpu = 1, dl_cuda = 2, dl_cuda_host = 3, dl_cuda_managed = 13 };

struct dl_device {
  std::int32_t type, id;
};

struct dl_data_type {
  std::uint8_t code;  // 0 int, 1 unsigned int, 2 float
  std::uint8_t bits;
  std::uint16_t lanes;
};

struct dl_tensor {
  void* data;
  dl_device device;
  std::int32_t dimensions;
  dl_data_type type;
  std::int64_t* shape;
  std::int64_t* strides;  // in elements; null: C order
  std::uint64_t byte_offset;
};

struct dl_managed_tensor {
  dl_tensor tensor;
  void* manager;
  void (*deleter)(dl_managed_tensor*);
};

}  // namespace gart_python
