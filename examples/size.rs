//! Sizes.
use cornermill::codec::{chunk::*, Level};
use std::time::Instant;
fn u32s(p: &str) -> Vec<u32> { let b=std::fs::read(p).unwrap(); b[4096..].chunks_exact(4).map(|x| u32::from_le_bytes(x.try_into().unwrap())).collect() }
fn run(p: &Piece, name: &str, level: Level) -> usize {
    let t=Instant::now();
    let c=encode(p, level).unwrap(); let (b,split)=(c.bytes,c.split);
    let te=t.elapsed().as_secs_f64();
    let t=Instant::now();
    let back=decode(&b, c.extent, level).unwrap();
    let td=t.elapsed().as_secs_f64();
    let key=|p: &Piece| { let mut v: Vec<[[i32;3];3]> = p.triangles.iter().map(|t| { let mut q=t.map(|v| p.positions[v as usize]); let r=(0..3).map(|i| {let mut x=q; x.rotate_left(i); x}).min().unwrap(); q=r; q}).collect(); v.sort(); v};
    if key(p)!=key(&back) { println!("DIFFERENT {name}"); }
    let mt=p.triangles.len() as f64/1e6;
    print!(" {name} {} [{:.2}+{:.2} bpv] ({:.2} {:.2})", b.len(), split[0] as f64*8.0/p.positions.len() as f64, split[1] as f64*8.0/p.positions.len() as f64, mt/te, mt/td);
    b.len()
}
fn main() {
    let draco: Vec<Vec<String>> = std::fs::read_to_string("/tmp/m/codec/draco.txt").unwrap().lines().map(|l| l.split(' ').map(str::to_owned).collect()).collect();
    let only=std::env::args().nth(1).unwrap_or_default();
    let (mut sf, mut ss, mut n)=(0.0,0.0,0.0);
    for name in ["helens","iso","turbineblade","cycloidal","idgh","sphere","torus","blobs"] {
        if !only.is_empty() && !name.starts_with(&only) { continue; }
        let v=u32s(&format!("/tmp/m/codec/{name}.ct/V.npy"));
        let g: Vec<f32>=u32s(&format!("/tmp/m/codec/{name}.ct/G.npy")).into_iter().map(f32::from_bits).collect();
        for bits in [11u32,14,16] {
            let mut lo=[f32::MAX;3]; let mut hi=[f32::MIN;3];
            for p in g.chunks_exact(3) { for k in 0..3 { lo[k]=lo[k].min(p[k]); hi[k]=hi[k].max(p[k]); } }
            let range=(0..3).map(|k| hi[k]-lo[k]).fold(0f32,f32::max);
            let max=((1u32<<bits)-1) as f32; let inv=max/range;
            let positions=g.chunks_exact(3).map(|p| [0,1,2].map(|k| ((p[k]-lo[k])*inv+0.5).floor() as i32)).collect();
            let piece=Piece{triangles: v.chunks_exact(3).map(|t| [t[0],t[1],t[2]]).collect(), positions, loose: vec![]};
            let d=draco.iter().find(|l| l[0]==name && l[1]==bits.to_string()).map(|l| l[2].parse::<f64>().unwrap());
            print!("{name} {bits} draco {d:?}");
            let f=run(&piece,"fast",Level::Fast) as f64;
            let s=run(&piece,"strong",Level::Strong) as f64;
            if let Some(d)=d { println!(" {:.3} {:.3}", f/d, s/d); sf+=(f/d).ln(); ss+=(s/d).ln(); n+=1.0; } else { println!(); }
        }
    }
    println!("mean fast {:.4} strong {:.4} of {n}", (sf/n).exp(), (ss/n).exp());
}
