//! Networks that are read, computed and refused.

use prost::Message;

use super::*;
use crate::proto;
use crate::tensor::Values;

fn node(op: &str, inputs: &[&str], outputs: &[&str]) -> proto::Node {
    let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
    proto::Node { op_type: op.into(), input: names(inputs), output: names(outputs), ..Default::default() }
}

fn value(name: &str, shape: &[Option<i64>]) -> proto::ValueInfo {
    let dim = shape.iter().map(|&value| proto::Dimension { value }).collect();
    let tensor = proto::TensorType { element: 1, shape: Some(proto::Shape { dim }) };
    proto::ValueInfo { name: name.into(), kind: Some(proto::Type { tensor: Some(tensor) }) }
}

fn stored(name: &str, dims: &[i64], float_data: &[f32]) -> proto::Tensor {
    let (dims, float_data) = (dims.to_vec(), float_data.to_vec());
    proto::Tensor { name: name.into(), dims, data_type: 1, float_data, ..Default::default() }
}

/// y = relu(x W^T + b) - z for x with 2 numbers.
fn model() -> proto::Model {
    let mut gemm = node("Gemm", &["x", "w", "b"], &["a"]);
    gemm.attribute.push(proto::Attribute { name: "transB".into(), i: 1, ..Default::default() });
    let nodes = vec![
        gemm,
        node("Relu", &["a"], &["c"]),
        node("Neg", &["z"], &["d"]),
        node("Add", &["c", "d"], &["y"]),
    ];
    proto::Model {
        opset_import: vec![proto::OperatorSet { domain: String::new(), version: 17 }],
        graph: Some(proto::Graph {
            node: nodes,
            initializer: vec![
                stored("w", &[3, 2], &[1.0, 2.0, 3.0, 4.0, -5.0, -6.0]),
                stored("b", &[3], &[0.5, 0.0, 0.0]),
                stored("z", &[1], &[1.0]),
            ],
            input: vec![value("x", &[None, Some(2)])],
            output: vec![value("y", &[None, Some(3)])],
        }),
    }
}

fn changed(change: impl FnOnce(&mut proto::Graph)) -> Vec<u8> {
    let mut model = model();
    change(model.graph.as_mut().unwrap());
    model.encode_to_vec()
}

fn refusal(bytes: &[u8]) -> String {
    Network::from_bytes(bytes).unwrap_err().to_string()
}

#[test]
fn a_network_is_computed_and_what_depends_on_no_input_only_once() {
    let network = Network::from_bytes(&model().encode_to_vec()).unwrap();
    assert_eq!((network.len(), network.is_empty()), (3, false));
    let x = Tensor::f32(&[2, 2], vec![1.0, 1.0, -1.0, 0.0]).unwrap();
    let y = network.run(vec![x]).unwrap();
    assert_eq!((y[0].shape(), y[0].as_f32().unwrap()), (&[2, 3][..], &[2.5, 6.0, -1.0, -1.0, -1.0, 4.0][..]));
    assert_eq!(network.inputs()[0].shape_text(), "[?, 2]");
}

#[test]
fn arrays_that_do_not_fit_are_refused() {
    let network = Network::from_bytes(&model().encode_to_vec()).unwrap();
    let says = |inputs: Vec<Tensor>| network.run(inputs).unwrap_err().to_string();
    assert_eq!(says(vec![]), "0 arrays are given for 1 inputs");
    let e = says(vec![Tensor::f32(&[1, 3], vec![0.0; 3]).unwrap()]);
    assert_eq!(e, "input `x`: FLOAT [1, 3] is given, but it takes FLOAT [?, 2]");
    let e = says(vec![Tensor::new(vec![1, 2], Values::I64(vec![0; 2])).unwrap()]);
    assert_eq!(e, "input `x`: INT64 [1, 2] is given, but it takes FLOAT [?, 2]");
    let fits_no_more = changed(|graph| graph.initializer[1] = stored("b", &[4], &[0.0; 4]));
    let network = Network::from_bytes(&fits_no_more).unwrap();
    let e = network.run(vec![network.inputs()[0].zeros().unwrap()]).unwrap_err().to_string();
    assert_eq!(e, "node #0 (Gemm): shapes [4] and [1, 3] do not fit together");
}

#[test]
fn what_cannot_be_read_is_named() {
    assert!(refusal(b"not a model").starts_with("not a model in ONNX format: "));
    assert_eq!(refusal(&[]), "not a model in ONNX format: there is no graph");
    let old = proto::Model { opset_import: vec![], ..model() };
    let e = refusal(&old.encode_to_vec());
    assert_eq!(e, "no version of ONNX's operators (opset) is asked for; 13 to 26 are supported");
    let e = refusal(&changed(|graph| graph.node[1].op_type = "Loop".into()));
    assert!(e.starts_with("node #1 (Loop): this operator is not supported; "), "{e}");
    let e = refusal(&changed(|graph| graph.node[1].domain = "com.example".into()));
    assert_eq!(e, "node #1 (Relu): operators of domain `com.example` are not supported");
    let e = refusal(&changed(|graph| graph.node[0].attribute[0].name = "transC".into()));
    assert_eq!(e, "node #0 (Gemm): attribute `transC` is not supported");
    let e = refusal(&changed(|graph| graph.node[0].input[0] = "y".into()));
    assert_eq!(e, "node #0 (Gemm): its input `y` is not given by any node before it");
    let e = refusal(&changed(|graph| graph.node[1].output[0] = "a".into()));
    assert_eq!(e, "the name `a` is given twice");
    let e = refusal(&changed(|graph| graph.initializer[1].float_data[2] = f32::NAN));
    assert_eq!(e, "array `b`: it holds NaN");
    let e = refusal(&changed(|graph| graph.initializer[1].float_data.truncate(2)));
    assert_eq!(e, "array `b`: it holds 2 numbers, but its shape has 3");
    let e = refusal(&changed(|graph| graph.initializer[1].data_type = 11));
    assert_eq!(
        e,
        "array `b`: numbers of type DOUBLE are not supported; use FLOAT, INT64, INT32, UINT8 or BOOL"
    );
    let e = refusal(&changed(|graph| graph.initializer[1].data_location = 1));
    assert_eq!(e, "array `b`: its numbers stand in another file; save the model as one file");
    let e = refusal(&changed(|graph| graph.output[0].name = "q".into()));
    assert_eq!(e, "output `q`: no node gives it");
    let e = refusal(&changed(|graph| graph.initializer[1].dims = vec![1 << 40, 1 << 40]));
    assert!(e.contains("is larger than 16777216 numbers"), "{e}");
}

/// y = relu(conv(x)), perhaps with other uses of what the convolution gives.
fn rectified(other: &[proto::Node], outputs: &[&str]) -> Network {
    let mut model = model();
    let graph = model.graph.as_mut().unwrap();
    graph.initializer =
        vec![stored("w", &[4, 1, 3, 3], &[0.5; 36]), stored("b", &[4], &[-1.0, 0.0, 1.0, 2.0])];
    graph.input = vec![value("x", &[Some(1), Some(1), None, None])];
    graph.node = vec![node("Conv", &["x", "w", "b"], &["a"]), node("Relu", &["a"], &["y"])];
    graph.node.extend(other.iter().cloned());
    graph.output = outputs.iter().map(|name| value(name, &[None; 4])).collect();
    Network::from_bytes(&model.encode_to_vec()).unwrap()
}

#[test]
fn a_relu_is_joined_to_a_convolution_that_nothing_else_uses() {
    let x = Tensor::f32(&[1, 1, 80, 70], (0..5600).map(|i| (i * 79 % 101) as f32 / 50.0 - 1.0).collect());
    let run = |network: &Network| network.run(vec![x.clone().unwrap()]).unwrap();
    let (joined, kept) = (rectified(&[], &["y"]), rectified(&[], &["a", "y"]));
    assert_eq!((joined.len(), kept.len()), (1, 2));
    let wanted = run(&kept).remove(1);
    // Each run but the first computes in the memory of the one before.
    for _ in 0..3 {
        assert_eq!(run(&joined)[0], wanted);
    }
    let used = rectified(&[node("Sub", &["y", "a"], &["d"]), node("Add", &["a", "d"], &["e"])], &["e"]);
    assert_eq!((used.len(), run(&used)[0].shape()), (4, wanted.shape()));
}

#[test]
fn memory_and_work_are_bounded() {
    let whole = |name: &str, numbers: &[i64]| proto::Tensor {
        name: name.into(),
        dims: vec![numbers.len() as i64],
        data_type: 7,
        int64_data: numbers.to_vec(),
        ..Default::default()
    };
    let filled = |shape: &[i64], nodes: Vec<proto::Node>| {
        let shape = whole("s", shape);
        changed(|graph| {
            graph.initializer.push(shape);
            graph.node.push(node("ConstantOfShape", &["s"], &["big"]));
            graph.node.extend(nodes);
        })
    };
    let e = refusal(&filled(&[1 << 30], vec![]));
    assert!(e.starts_with("node #4 (ConstantOfShape): an array of shape [1073741824] is larger"), "{e}");
    let e = refusal(&filled(&[4096, 4096], vec![node("MatMul", &["big", "big"], &["square"])]));
    assert_eq!(e, "node #5 (MatMul): a run takes more than 17179869184 products");
    let copies = (0..5).map(|i| node("Identity", &["big"], &[&format!("copy{i}")])).collect();
    let e = refusal(&filled(&[4096, 4096], copies));
    assert_eq!(e, "node #7 (Identity): more than 67108864 numbers are held at a time");
}

#[test]
fn damaged_files_are_refused_or_computed() {
    let good = model().encode_to_vec();
    let mut state = 1_u32;
    let mut next = |below: usize| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as usize % below
    };
    let (mut read, mut refused) = (0, 0);
    for _ in 0..20_000 {
        let mut bytes = good.clone();
        for _ in 0..1 + next(3) {
            let at = next(bytes.len());
            match next(3) {
                0 => bytes[at] ^= 1 << next(8),
                1 => bytes[at] = next(256) as u8,
                _ => bytes.truncate(at.max(1)),
            }
        }
        match Network::from_bytes(&bytes) {
            Err(_) => refused += 1,
            Ok(network) => {
                read += 1;
                let inputs: Result<Vec<Tensor>, _> = network.inputs().iter().map(Port::zeros).collect();
                let _ = inputs.and_then(|inputs| network.run(inputs));
            }
        }
    }
    assert!(read > 1000 && refused > 1000, "{read} read, {refused} refused");
}
