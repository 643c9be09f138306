//! How things look in USD: meshes inside the file, colours by vertex, and images by a preview surface.

use nalgebra::Vector3;

use super::scene::Part;
use super::usd::{Usda, triple};
use super::xml::number;
use crate::geometry::{Mesh, Texture};
use crate::twin::Model;

impl Usda {
    /// The material that puts a part's image on it, where it has one.
    pub(super) fn colors(&mut self, part: &Part) {
        let Some(image) = &part.texture else { return };
        let own = format!("</scene/{}_colors", part.name);
        self.open(&format!("def Material \"{}_colors\"", part.name), &[], &[]);
        self.line(&format!(
            "token outputs:surface.connect = {own}/shader.outputs:surface>"
        ));
        self.shader(
            "shader",
            "UsdPreviewSurface",
            &[
                format!("color3f inputs:diffuseColor.connect = {own}/image.outputs:rgb>"),
                "float inputs:metallic = 0".into(),
                "float inputs:roughness = 0.8".into(),
                "token outputs:surface".into(),
            ],
        );
        self.shader(
            "image",
            "UsdUVTexture",
            &[
                format!("asset inputs:file = @{image}@"),
                "token inputs:sourceColorSpace = \"sRGB\"".into(),
                "token inputs:wrapS = \"clamp\"".into(),
                "token inputs:wrapT = \"clamp\"".into(),
                format!("float2 inputs:st.connect = {own}/places.outputs:result>"),
                "float3 outputs:rgb".into(),
            ],
        );
        self.shader(
            "places",
            "UsdPrimvarReader_float2",
            &["string inputs:varname = \"st\"".into(), "float2 outputs:result".into()],
        );
        self.close();
    }

    fn shader(&mut self, name: &str, id: &str, lines: &[String]) {
        self.open(&format!("def Shader \"{name}\""), &[], &[]);
        self.line(&format!("uniform token info:id = \"{id}\""));
        lines.iter().for_each(|l| self.line(l));
        self.close();
    }

    /// What is seen of a part.
    pub(super) fn visual(&mut self, part: &Part, mesh: &Mesh, model: &Model) {
        let texture = part.visual.as_ref().and_then(|p| model.textures.get(p));
        let schemas: &[&str] = if texture.is_some() {
            &["MaterialBindingAPI"]
        } else {
            &[]
        };
        self.open(&format!("def Mesh \"{}_visual\"", part.name), schemas, &[]);
        if let Some(texture) = texture {
            self.line(&format!("rel material:binding = </scene/{}_colors>", part.name));
            self.places(texture);
        }
        self.mesh(mesh, &part.link_origin);
        self.close();
    }

    fn places(&mut self, texture: &Texture) {
        let place = |p: &[f64; 2]| format!("({}, {})", number(p[0]), number(p[1]));
        let places: Vec<String> = texture.places.iter().map(place).collect();
        let corners: Vec<String> = texture.corners.iter().flatten().map(u32::to_string).collect();
        self.line(&format!("texCoord2f[] primvars:st = [{}] (", places.join(", ")));
        self.line("    interpolation = \"faceVarying\"");
        self.line(")");
        self.line(&format!("int[] primvars:st:indices = [{}]", corners.join(", ")));
    }

    pub(super) fn mesh(&mut self, mesh: &Mesh, origin: &Vector3<f64>) {
        let join = |list: Vec<String>| list.join(", ");
        let points = mesh.vertices.iter().map(|v| triple(&(v.coords + origin))).collect();
        let corners = mesh.triangles.iter().flatten().map(u32::to_string).collect();
        self.line("uniform token subdivisionScheme = \"none\"");
        self.line(&format!("point3f[] points = [{}]", join(points)));
        self.line(&format!(
            "int[] faceVertexCounts = [{}]",
            join(vec!["3".into(); mesh.triangles.len()])
        ));
        self.line(&format!("int[] faceVertexIndices = [{}]", join(corners)));
        if mesh.colors.len() == mesh.vertices.len() && !mesh.colors.is_empty() {
            let color = |c: &[u8; 3]| triple(&Vector3::from(c.map(linear)));
            let colors = mesh.colors.iter().map(color).collect();
            let head = "color3f[] primvars:displayColor";
            self.line(&format!(
                "{head} = [{}] (\n{}interpolation = \"vertex\"",
                join(colors),
                "    ".repeat(self.depth + 1)
            ));
            self.line(")");
        }
    }
}

/// sRGB byte to linear light (IEC 61966-2-1).
fn linear(byte: u8) -> f64 {
    let c = f64::from(byte) / 255.0;
    let light = if c <= 0.04045 {
        c / 12.92
    } else {
        ((c + 0.055) / 1.055).powf(2.4)
    };
    (light * 1e4).round() / 1e4
}
